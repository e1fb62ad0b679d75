// Live plots against time.
export { default as UPlot } from "uplot";
