// Cameras: the orbit camera that gestures move, and the projection of points onto the picture.
//
// An orbit is {kind: "orbit", target, azimuth, elevation, distance, yfov, projection, height}, with angles in degrees as
// in `render --orbit`, and lengths in units of the scene. A frame's camera is {view_point, u, v, w, d, rect, projection},
// with rect = [l, r, b, t] on the plane at distance d. Functions return new orbits.

import { add, dot, length, scale, subtract } from "./vectors.js";

const DEGREE = Math.PI / 180;
/** Space around what is framed, as a factor of its radius. */
const MARGIN = 1.1;
/** Field of view of framed views, in degrees. */
const DEFAULT_YFOV = 40;
/** Distances are limited to the radius of the scene times and divided by this. */
const FARTHEST = 1e4;

const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

/** Views by name: azimuth and elevation in degrees. */
export const STANDARD_VIEWS = {
  front: [0, 0],
  back: [180, 0],
  right: [90, 0],
  left: [-90, 0],
  top: [0, 90],
  bottom: [0, -90],
  isometric: [45, 35.26],
};

/** Returns the sphere around a box, or a unit sphere if there is no box. */
export function sphereOf(bounds) {
  if (!bounds) return { centre: [0, 0, 0], radius: 1 };
  const radius = length(subtract(bounds.max, bounds.min)) / 2;
  return { centre: scale(add(bounds.min, bounds.max), 0.5), radius: radius > 0 ? radius : 1 };
}

/** Returns the basis of an orbit. It is defined straight above and below, too. */
function basisOf({ azimuth, elevation }) {
  const [sa, ca] = [Math.sin(azimuth * DEGREE), Math.cos(azimuth * DEGREE)];
  const [se, ce] = [Math.sin(elevation * DEGREE), Math.cos(elevation * DEGREE)];
  return { u: [ca, 0, -sa], v: [-se * sa, ce, -se * ca], w: [ce * sa, se, ce * ca] };
}

/** Returns the height of the view rectangle at the target. */
const heightAtTarget = orbit =>
  orbit.projection === "orthographic" ? orbit.height : 2 * orbit.distance * Math.tan((orbit.yfov * DEGREE) / 2);

/** Rotates the camera about its target. Stops at the poles. */
export function turn(orbit, azimuth, elevation) {
  const turned = (orbit.azimuth + azimuth) % 360;
  return {
    ...orbit,
    azimuth: turned > 180 ? turned - 360 : turned <= -180 ? turned + 360 : turned,
    elevation: clamp(orbit.elevation + elevation, -90, 90),
  };
}

/** Moves the target by a part of the picture's height, to the right and down. */
export function pan(orbit, right, down) {
  const { u, v } = basisOf(orbit);
  const height = heightAtTarget(orbit);
  return { ...orbit, target: add(orbit.target, add(scale(u, -right * height), scale(v, down * height))) };
}

/**
 * Zooms by a factor, above 1 to come closer. The point of the target's plane at (x, y) stays where it is:
 * x and y are in heights of the picture, from its centre, to the right and down.
 */
export function zoom(orbit, factor, x, y, radius) {
  const largest = radius * FARTHEST;
  const size = orbit.projection === "orthographic" ? orbit.height : orbit.distance;
  const next = clamp(size / factor, radius / FARTHEST, largest);
  const share = 1 - next / size;
  const height = heightAtTarget(orbit);
  const { u, v } = basisOf(orbit);
  const target = add(orbit.target, add(scale(u, x * height * share), scale(v, -y * height * share)));
  // Both are scaled, so that a change of the projection keeps the size.
  return {
    ...orbit,
    target,
    distance: clamp((orbit.distance * next) / size, radius / FARTHEST, largest),
    height: (orbit.height * next) / size,
  };
}

/** Changes the projection and keeps the size of what is at the target. */
export function withProjection(orbit, projection) {
  if (projection === orbit.projection) return orbit;
  const height = heightAtTarget(orbit);
  return projection === "orthographic"
    ? { ...orbit, projection, height }
    : { ...orbit, projection, distance: height / (2 * Math.tan((orbit.yfov * DEGREE) / 2)) };
}

/** Changes the field of view, in degrees, and keeps the size of what is at the target. */
export function withYfov(orbit, yfov) {
  const height = heightAtTarget(orbit);
  return { ...orbit, yfov, distance: height / (2 * Math.tan((yfov * DEGREE) / 2)) };
}

/** Moves the camera until a sphere is in view. `aspect` is width by height of the picture. */
export function frame(orbit, sphere, aspect) {
  const tangent = Math.tan((orbit.yfov * DEGREE) / 2) * Math.min(1, aspect);
  const radius = MARGIN * sphere.radius;
  return {
    ...orbit,
    target: sphere.centre,
    distance: (radius * Math.hypot(1, tangent)) / tangent,
    height: (2 * radius) / Math.min(1, aspect),
  };
}

/** Returns a view's camera with all its fields. */
export function completed(camera, sphere, aspect) {
  return camera.kind === "orbit" ? { ...defaultOrbit(sphere, aspect), ...withoutNulls(camera) } : camera;
}

const withoutNulls = object => Object.fromEntries(Object.entries(object).filter(([, value]) => value !== null));

/** Returns the view that frames a sphere from above, right of the front. */
export function defaultOrbit(sphere, aspect) {
  const orbit = { kind: "orbit", azimuth: 35.5, elevation: 22, yfov: DEFAULT_YFOV, projection: "perspective" };
  return frame({ ...orbit, target: sphere.centre, distance: 1, height: 1 }, sphere, aspect);
}

/** Returns the orbit that sees what a frame's camera sees, but for its roll and shift. */
export function orbitOf(camera, sphere) {
  const { view_point, w, d, rect, projection } = camera;
  const depth = dot(subtract(view_point, sphere.centre), w);
  const distance = depth > sphere.radius / FARTHEST ? depth : sphere.radius;
  const isFlat = projection === "orthographic";
  const height = rect[3] - rect[2];
  const yfov = isFlat ? DEFAULT_YFOV : (2 * Math.atan(height / (2 * d))) / DEGREE;
  return {
    kind: "orbit",
    target: subtract(view_point, scale(w, distance)),
    azimuth: Math.atan2(w[0], w[2]) / DEGREE,
    elevation: Math.asin(clamp(w[1], -1, 1)) / DEGREE,
    distance,
    yfov,
    projection,
    height: isFlat ? height : (height * distance) / d,
  };
}

/** Rounds an orbit to what is visible, so that commands are short. */
export function rounded(orbit, radius) {
  const size = Math.min(radius, heightAtTarget(orbit));
  const digits = clamp(4 - Math.floor(Math.log10(size)), 0, 20);
  const short = x => Number(x.toFixed(digits));
  const angle = x => Number(x.toFixed(2));
  return {
    ...orbit,
    target: orbit.target.map(short),
    azimuth: angle(orbit.azimuth),
    elevation: angle(orbit.elevation),
    distance: Number(orbit.distance.toPrecision(6)),
    height: Number(orbit.height.toPrecision(6)),
    yfov: Number(orbit.yfov.toPrecision(6)),
  };
}

/** Returns the camera of an orbit, like that of a frame. */
export function cameraOf(orbit, aspect) {
  const { u, v, w } = basisOf(orbit);
  const half = heightAtTarget(orbit) / 2;
  return {
    view_point: add(orbit.target, scale(w, orbit.distance)),
    u, v, w,
    d: orbit.distance,
    rect: [-half * aspect, half * aspect, -half, half],
    projection: orbit.projection,
  };
}

/**
 * Projects a segment onto the picture, and returns its ends: x and y from 0 to 1, from the top left corner.
 * Returns null if the segment is behind the camera.
 */
export function projectSegment(camera, a, b) {
  const { view_point, u, v, w, d, rect: [l, r, bottom, t], projection } = camera;
  const isFlat = projection === "orthographic";
  const inCamera = p => {
    const q = subtract(p, view_point);
    return [dot(q, u), dot(q, v), -dot(q, w)];
  };
  let [from, to] = [inCamera(a), inCamera(b)];
  if (!isFlat) {
    const near = d * 1e-3;
    if (from[2] < near && to[2] < near) return null;
    const cut = (inside, outside) =>
      add(inside, scale(subtract(outside, inside), (inside[2] - near) / (inside[2] - outside[2])));
    if (from[2] < near) from = cut(to, from);
    if (to[2] < near) to = cut(from, to);
  }
  return [from, to].map(([x, y, z]) => {
    const factor = isFlat ? 1 : d / z;
    return [(x * factor - l) / (r - l), (t - y * factor) / (t - bottom)];
  });
}

/** Returns the twelve edges of a box, as pairs of corners. */
export function edgesOf({ min, max }) {
  const corner = i => [0, 1, 2].map(axis => ((i >> axis) & 1 ? max[axis] : min[axis]));
  const edges = [];
  for (let i = 0; i < 8; i++) {
    for (const bit of [1, 2, 4]) if (!(i & bit)) edges.push([corner(i), corner(i | bit)]);
  }
  return edges;
}
