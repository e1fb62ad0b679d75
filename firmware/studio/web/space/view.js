// The space view: the camera along its path, and a picture through its lens.
import { OrbitControls, PerspectiveCamera, Vector3, WebGLRenderer } from "../vendor/space.js";
import { effect, html, useEffect, useRef, useState } from "../vendor/ui.js";
import { readColours } from "../curve/colours.js";
import { boundsOf, poseAt } from "./lens.js";
import { PointDrag, PointFields, placesOf } from "./points.js";
import { Stage, aspect } from "./stage.js";

const count = 600; // poses along the move
const keyGap = 0.5e-3;

class SpaceView {
  constructor(canvas, session, machine) {
    this.canvas = canvas;
    this.session = session;
    this.machine = machine;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.colours = readColours(canvas);
    this.stage = new Stage(this.colours);
    this.camera = new PerspectiveCamera(45, 1, 0.01, 2000);
    this.camera.up.set(0, 0, 1);
    this.stage.onlooker(this.camera);
    this.drag = new PointDrag(this); // before the controls, which it keeps from its events
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.want());
    this.poses = null;
    this.hasFramed = false;
    this.wanted = null;
  }

  get end() {
    return Math.max(this.session.duration.value, 1e-3);
  }

  // The plan is another: all poses anew.
  async read(onEmpty) {
    const answer = await this.session.poses(0, this.end, count);
    if (answer === null) return;
    this.poses = answer.poses;
    this.size = answer.size;
    this.subjects = answer.subject;
    onEmpty(this.poses === null);
    if (this.poses === null) {
      this.stage.clear();
      this.want();
      return;
    }
    const points = Array.from({ length: count }, (_, i) => poseAt(this.poses, this.size, i).at);
    this.stage.showPath(
      points,
      this.#keyTimes().map((t) => this.#pose(t).at),
    );
    if (!this.hasFramed) this.frame();
    this.showPoints();
    this.show();
  }

  #keyTimes() {
    const times = this.session.axes.value.flatMap((axis) => axis.keys.map((key) => key.t));
    return times.filter(
      (t, i) =>
        t >= 0 && t <= this.end && !times.slice(0, i).some((each) => Math.abs(each - t) < keyGap),
    );
  }

  #index(t) {
    return Math.min(Math.max(Math.round((t / this.end) * (count - 1)), 0), count - 1);
  }

  #pose(t) {
    return poseAt(this.poses, this.size, this.#index(t));
  }

  #subject(t) {
    const at = 3 * this.#index(t);
    if (!this.subjects || Number.isNaN(this.subjects[at])) return null;
    return [...this.subjects.subarray(at, at + 3)];
  }

  show() {
    if (!this.poses) return;
    const t = this.session.playhead.value;
    const pose = this.#pose(t);
    this.stage.showPose(pose, pose.hasSubject ? this.#subject(t) : null);
    const actual = this.machine.machineAt.value;
    this.stage.showActual(actual === null ? null : this.#pose(actual));
    this.want();
    void this.#showBody(t);
  }

  showApproach(approach) {
    const poses = approach?.poses ?? [];
    const points = Array.from(
      { length: approach?.poses ? poses.length / approach.size : 0 },
      (_, i) => poseAt(poses, approach.size, i).at,
    );
    this.stage.showApproach(points);
    this.want();
  }

  async #showBody(t) {
    const answer = await this.session.body(t);
    if (answer?.lines === undefined) return;
    this.stage.showBody(answer.lines);
    this.want();
  }

  // Those that can be dragged.
  places() {
    return this.poses ? placesOf(this.session.points.value, this.drag.dragged) : [];
  }

  showPoints() {
    const { points, point } = this.session;
    const picked = points.value[point.value];
    const places = this.places();
    this.stage.showPoints(
      places,
      places.findIndex((each) => each.point === picked),
    );
    this.want();
  }

  frame() {
    const { centre, radius } = boundsOf(
      this.poses,
      this.size,
      this.places().map((place) => place.at),
    );
    const target = new Vector3(...centre);
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(new Vector3(2.2, -3, 2).multiplyScalar(radius));
    this.controls.update();
    this.hasFramed = true;
    this.want();
  }

  want() {
    this.wanted ??= requestAnimationFrame(() => {
      this.wanted = null;
      this.paint();
    });
  }

  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setPixelRatio(devicePixelRatio || 1);
    this.renderer.setSize(clientWidth || 1, clientHeight || 1, false);
    this.paint(); // as the curve editor does
  }

  paint() {
    const { renderer, stage } = this;
    const width = this.canvas.clientWidth || 1;
    const height = this.canvas.clientHeight || 1;
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width, height);
    renderer.setClearColor(this.colours.ground);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    renderer.render(stage.scene, this.camera);
    if (!this.poses) return;
    // The picture through the lens, at the lower right.
    const wide = Math.min(width * 0.4, 320);
    const high = wide / aspect;
    const box = [width - wide - 8, 8, wide, high];
    renderer.setScissorTest(true);
    renderer.setScissor(...box);
    renderer.setViewport(...box);
    renderer.setClearColor(this.colours.pane);
    renderer.render(stage.scene, stage.lens);
  }

  dispose() {
    cancelAnimationFrame(this.wanted);
    this.controls.dispose();
    this.renderer.dispose();
  }
}

function connect(canvas, session, machine, onEmpty, view, onRead) {
  let space;
  try {
    space = new SpaceView(canvas, session, machine);
  } catch {
    onEmpty("This browser has no WebGL.");
    return () => {};
  }
  view.current = space;
  session.space = space;
  const sizes = new ResizeObserver(() => space.fit());
  sizes.observe(canvas);
  const stops = [
    effect(() => {
      void session.report.value;
      void space.read((isEmpty) => {
        onEmpty(isEmpty ? "This rig has no kinematics: the pose of its camera is unknown." : "");
        onRead();
      });
    }),
    effect(() => {
      void [session.playhead.value, machine.machineAt.value];
      space.show();
    }),
    effect(() => space.showApproach(session.approach.value)),
    effect(() => {
      void [session.points.value, session.point.value];
      space.showPoints();
    }),
  ];
  return () => {
    stops.forEach((stop) => stop());
    sizes.disconnect();
    space.dispose();
  };
}

function Figures({ session, view }) {
  const t = session.playhead.value;
  void session.report.value;
  const space = view.current;
  if (!space?.poses) return null;
  const pose = poseAt(space.poses, space.size, Math.round((t / space.end) * (count - 1)));
  return html`<p class="quiet">
    camera ${pose.at.map((value) => value.toFixed(2)).join(", ")} m
    ${pose.hasSubject ? `, subject at ${pose.distance.toFixed(2)} m` : ""}
    ${pose.focus === null ? "" : `, focus at ${pose.focus.toFixed(2)} m`}
    ${pose.focal === null ? "" : `, ${pose.focal.toFixed(0)} mm`}; lower right: through the lens
  </p>`;
}

export function Space({ session, machine }) {
  const canvas = useRef(null);
  const view = useRef(null);
  const [empty, setEmpty] = useState("");
  const [read, setRead] = useState(0);
  const onRead = () => setRead((n) => n + 1);
  useEffect(() => connect(canvas.current, session, machine, setEmpty, view, onRead), [session]);
  return html`<section aria-label="Space" class="space-panel">
    <canvas ref=${canvas} role="img" tabindex="-1" aria-label="The camera along its path, and the picture through its lens"></canvas>
    ${empty ? html`<p class="quiet">${empty}</p>` : html`<${Figures} session=${session} view=${view} read=${read} />`}
    <${PointFields} session=${session} />
    <button onClick=${() => view.current?.poses && view.current.frame()}>Show all</button>
  </section>`;
}
