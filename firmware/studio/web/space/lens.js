// What a lens sees.
const sensorWidth = 36; // mm, a full frame

// Vertical angle of view in degrees for a focal length in mm and a picture of so
// many widths to a height.
export function verticalAngle(focal, aspect) {
  if (!(focal > 0)) return 40;
  return (2 * Math.atan(sensorWidth / aspect / 2 / focal) * 180) / Math.PI;
}

// The corners of the frustum at a distance, in the camera's own frame: x right, y
// up, -z forward.
export function frustumCorners(focal, aspect, distance) {
  const half = Math.tan((verticalAngle(focal, aspect) * Math.PI) / 360) * distance;
  const wide = half * aspect;
  return [
    [-wide, -half, -distance],
    [wide, -half, -distance],
    [wide, half, -distance],
    [-wide, half, -distance],
  ];
}

// One pose of the planner's numbers: { at, forward, left, up, focal, focus, subject }.
export function poseAt(poses, size, index) {
  const row = poses.subarray(index * size, (index + 1) * size);
  const triple = (at) => [row[at], row[at + 1], row[at + 2]];
  return {
    at: triple(0),
    forward: triple(3),
    left: triple(6),
    up: triple(9),
    focal: Number.isNaN(row[12]) ? null : row[12],
    focus: Number.isNaN(row[13]) ? null : row[13],
    hasSubject: row[14] === 1,
    distance: row[15],
  };
}

// The box that holds all points of a path, and others beside it, { centre, radius }.
export function boundsOf(poses, size, others = []) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  const take = (point) => {
    for (let i = 0; i < 3; i++) {
      if (Number.isNaN(point[i])) continue;
      low[i] = Math.min(low[i], point[i]);
      high[i] = Math.max(high[i], point[i]);
    }
  };
  for (let at = 0; at + size <= poses.length; at += size) take(poses.subarray(at, at + 3));
  others.forEach(take);
  if (!(low[0] <= high[0])) return { centre: [0, 0, 0], radius: 1 };
  const centre = low.map((value, i) => (value + high[i]) / 2);
  const radius = Math.max(0.5, Math.hypot(...low.map((value, i) => high[i] - value)) / 2);
  return { centre, radius };
}
