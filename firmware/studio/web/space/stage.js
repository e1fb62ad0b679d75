// The scene of the space view, in metres, z up as the rig has it.
import {
  AmbientLight,
  BufferGeometry,
  DirectionalLight,
  Float32BufferAttribute,
  GridHelper,
  Group,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Scene,
  SphereGeometry,
  Vector3,
  BoxGeometry,
  CylinderGeometry,
} from "../vendor/space.js";
import { frustumCorners, verticalAngle } from "./lens.js";

export const aspect = 16 / 9;
const pictureOnly = 1; // layer of what the camera itself sees

function lineOf(points, material) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points.flat(), 3));
  return new Line(geometry, material);
}

function frustumGeometry(focal, distance) {
  const corners = frustumCorners(focal, aspect, distance);
  const edges = corners.flatMap((corner, i) => [[0, 0, 0], corner, corner, corners[(i + 1) % 4]]);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(edges.flat(), 3));
  return geometry;
}

// The camera's place and axes as a matrix of three's: x right, y up, z backward.
function matrixOf(pose) {
  const right = pose.left.map((value) => -value);
  const back = pose.forward.map((value) => -value);
  return new Matrix4()
    .makeBasis(new Vector3(...right), new Vector3(...pose.up), new Vector3(...back))
    .setPosition(...pose.at);
}

class CameraModel {
  constructor(colour, opacity) {
    this.group = new Group();
    this.group.matrixAutoUpdate = false;
    const material = new MeshStandardMaterial({ color: colour, transparent: opacity < 1, opacity });
    const body = new Mesh(new BoxGeometry(0.12, 0.14, 0.22), material);
    body.position.z = 0.14;
    const lens = new Mesh(new CylinderGeometry(0.045, 0.05, 0.1, 24), material);
    lens.rotation.x = Math.PI / 2;
    lens.position.z = -0.01;
    this.frustum = new LineSegments(
      undefined,
      new LineBasicMaterial({ color: colour, transparent: true, opacity }),
    );
    this.group.add(body, lens, this.frustum);
  }

  show(pose, reach) {
    this.group.visible = pose !== null;
    if (pose === null) return;
    this.group.matrix.copy(matrixOf(pose));
    this.frustum.geometry.dispose();
    this.frustum.geometry = frustumGeometry(pose.focal ?? 35, reach);
  }
}

export class Stage {
  constructor(colours) {
    this.scene = new Scene();
    this.colours = colours;
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(3, -4, 8);
    this.grid = new GridHelper(20, 20, colours.line, colours.faint);
    this.grid.rotation.x = Math.PI / 2;
    this.planned = new CameraModel(colours.accent, 1);
    this.actual = new CameraModel(colours.bad, 0.6);
    this.subject = new Mesh(
      new SphereGeometry(0.12, 24, 16),
      new MeshStandardMaterial({ color: colours.axes[2] }),
    );
    this.focus = new Mesh(
      new SphereGeometry(0.05, 16, 12),
      new MeshStandardMaterial({ color: colours.axes[3], transparent: true, opacity: 0.8 }),
    );
    this.sight = lineOf(
      [
        [0, 0, 0],
        [0, 0, 0],
      ],
      new LineDashedMaterial({ color: colours.quiet, dashSize: 0.1, gapSize: 0.06 }),
    );
    this.path = new Group();
    this.approach = new Group(); // that the machine is about to go
    this.body = new Group(); // of the rig
    this.points = new Group(); // that can be dragged
    this.lens = new PerspectiveCamera(40, aspect, 0.05, 1000);
    this.lens.matrixAutoUpdate = false;
    // A camera does not see itself.
    for (const object of [this.planned.group, this.actual.group, this.path, this.sight, this.focus])
      object.traverse((each) => each.layers.set(pictureOnly));
    this.scene.add(
      new AmbientLight(0xffffff, 1.2),
      sun,
      this.grid,
      this.path,
      this.approach,
      this.body,
      this.points,
      this.sight,
      this.focus,
    );
    this.scene.add(this.planned.group, this.actual.group, this.subject);
  }

  // What an onlooker sees, beside what the lens sees.
  onlooker(camera) {
    camera.layers.enable(pictureOnly);
  }

  // `points`: of the whole move; `keys`: where it has keys.
  showPath(points, keys) {
    for (const each of this.path.children) each.geometry.dispose();
    this.path.clear();
    this.path.add(lineOf(points, new LineBasicMaterial({ color: this.colours.axes[0] })));
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(keys.flat(), 3));
    this.path.add(
      new Points(
        geometry,
        new PointsMaterial({ color: this.colours.text, size: 7, sizeAttenuation: false }),
      ),
    );
    this.path.traverse((each) => each.layers.set(pictureOnly));
  }

  // In m; the one at an index is picked.
  showPoints(points, picked) {
    for (const each of this.points.children) each.geometry.dispose();
    this.points.clear();
    points.forEach(({ kind, at }, i) => {
      const material = new MeshStandardMaterial({
        color: this.colours.axes[kind === "path" ? 0 : 2],
        emissive: i === picked ? this.colours.accent : 0,
      });
      const mesh = new Mesh(new SphereGeometry(i === picked ? 0.06 : 0.045, 16, 12), material);
      mesh.position.set(...at);
      this.points.add(mesh);
    });
    this.points.traverse((each) => each.layers.set(pictureOnly));
  }

  // Dashed; [] takes it away.
  showApproach(points) {
    for (const each of this.approach.children) each.geometry.dispose();
    this.approach.clear();
    if (points.length === 0) return;
    const line = lineOf(
      points,
      new LineDashedMaterial({ color: this.colours.bad, dashSize: 0.06, gapSize: 0.04 }),
    );
    line.computeLineDistances();
    this.approach.add(line);
    this.approach.traverse((each) => each.layers.set(pictureOnly));
  }

  // The rig itself: [{ isRail, points }].
  showBody(lines) {
    for (const each of this.body.children) each.geometry.dispose();
    this.body.clear();
    for (const { isRail, points } of lines) {
      const material = new LineBasicMaterial({
        color: isRail ? this.colours.line : this.colours.text,
      });
      this.body.add(lineOf(points, material));
    }
    this.body.traverse((each) => each.layers.set(pictureOnly));
  }

  showPose(pose, subject) {
    const reach = pose.focus ?? (pose.hasSubject ? pose.distance : 1.5);
    this.planned.show(pose, reach);
    this.lens.matrix.copy(matrixOf(pose));
    this.lens.matrixWorldNeedsUpdate = true;
    this.lens.fov = verticalAngle(pose.focal ?? 35, aspect);
    this.lens.updateProjectionMatrix();
    this.subject.visible = subject !== null;
    this.sight.visible = subject !== null;
    if (subject !== null) {
      this.subject.position.set(...subject);
      this.sight.geometry.setFromPoints([new Vector3(...pose.at), new Vector3(...subject)]);
      this.sight.computeLineDistances();
    }
    this.focus.visible = pose.focus !== null;
    if (pose.focus !== null)
      this.focus.position.set(...pose.at.map((value, i) => value + pose.forward[i] * pose.focus));
  }

  showActual(pose) {
    this.actual.show(pose, 1);
  }

  clear() {
    for (const object of [
      this.planned.group,
      this.actual.group,
      this.subject,
      this.sight,
      this.focus,
    ])
      object.visible = false;
    for (const each of this.path.children) each.geometry.dispose();
    this.path.clear();
    this.showBody([]);
    this.showPoints([], -1);
  }
}
