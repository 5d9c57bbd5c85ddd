// A look-at camera, as the service takes it: {eye, target, up, fov}, fov vertical in degrees; one that is `flat` is
// orthographic, and shows as much as it would of the plane through its target. All functions are pure
// and return new cameras. The camera frame is x right, y down, z forward, as in api/cameras.md; pixels count from the
// corner.

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const times = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(a, 1 / length(a));
export const distance = (camera) => length(sub(camera.target, camera.eye));

/** The camera's axes in the world. */
export function axes(camera) {
  const forward = unit(sub(camera.target, camera.eye));
  const right = unit(cross(forward, camera.up));
  return {right, down: cross(forward, right), forward};
}

/** Focal length for an image of this height, in the height's unit. */
export const focal = (camera, height) => height / 2 / Math.tan((camera.fov * Math.PI) / 360);

/** The vertical field of view, degrees, of an image of this size that shows at least so many degrees across and upright. */
export function fitted([across, upright], [width, height]) {
  const degree = Math.PI / 360;
  return Math.max(upright, Math.min(179, (2 * Math.atan((Math.tan(across * degree) * height) / width) * 180) / Math.PI));
}

/** [x, y, depth] of a world point in an image of size [width, height]; null behind the eye. */
export function project(camera, [width, height], point) {
  const {right, down, forward} = axes(camera);
  const p = sub(point, camera.eye);
  const z = dot(p, forward);
  const f = focal(camera, height) / (camera.flat ? distance(camera) : z);
  return z > 0 || camera.flat ? [f * dot(p, right) + width / 2, f * dot(p, down) + height / 2, z] : null;
}

/** Direction through a pixel, one long along the viewing axis. */
export function ray(camera, [width, height], [x, y]) {
  const {right, down, forward} = axes(camera);
  const f = focal(camera, height);
  return add(forward, add(times(right, (x - width / 2) / f), times(down, (y - height / 2) / f)));
}

/** What a pixel sees: from where, and in which direction. */
export function beam(camera, size, [x, y]) {
  if (!camera.flat) return {origin: camera.eye, direction: ray(camera, size, [x, y])};
  const {right, down, forward} = axes(camera),
    pixel = distance(camera) / focal(camera, size[1]);
  const beside = add(times(right, (x - size[0] / 2) * pixel), times(down, (y - size[1] / 2) * pixel));
  return {origin: add(camera.eye, beside), direction: forward};
}

/** Both ends of what is before the eye of a straight line between two world points, as project() has them; or null. */
export function segment(camera, size, a, b) {
  const {forward} = axes(camera),
    near = 1e-3 * distance(camera),
    depth = (p) => dot(sub(p, camera.eye), forward);
  if (camera.flat) return [project(camera, size, a), project(camera, size, b)];
  const [za, zb] = [depth(a), depth(b)];
  if (za < near && zb < near) return null;
  const cut = (p, q, zp, zq) => (zp >= near ? p : add(p, times(sub(q, p), (near - zp) / (zq - zp))));
  return [project(camera, size, cut(a, b, za, zb)), project(camera, size, cut(b, a, zb, za))];
}

/** Rodrigues: `v` turned by `angle` about the unit vector `axis`. */
function turn(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}

/** A viewing direction turned by yaw about `up` and by pitch, stopping short of the poles. */
function swing(direction, up, yaw, pitch) {
  const pole = unit(up);
  const angle = Math.acos(Math.min(1, Math.max(-1, dot(unit(direction), pole))));
  const wanted = Math.min(Math.PI - 0.01, Math.max(0.01, angle - pitch));
  return turn(turn(direction, unit(cross(direction, pole)), angle - wanted), pole, yaw);
}

/** Round the target. */
export function orbit(camera, yaw, pitch) {
  return {...camera, eye: sub(camera.target, swing(sub(camera.target, camera.eye), camera.up, yaw, pitch))};
}

/** Turns the head: the eye stays. */
export function look(camera, yaw, pitch) {
  return {...camera, target: add(camera.eye, swing(sub(camera.target, camera.eye), camera.up, yaw, pitch))};
}

/** Eye and target by so much along the camera's axes; `rise` goes along `up`. */
export function move(camera, rightward, rise, ahead) {
  const {right, forward} = axes(camera);
  const step = add(add(times(right, rightward), times(unit(camera.up), rise)), times(forward, ahead));
  return {...camera, eye: add(camera.eye, step), target: add(camera.target, step)};
}

/** What lies at the target's depth follows the pointer by (dx, dy) pixels of an image of this height. */
export function pan(camera, dx, dy, height) {
  const {right, down} = axes(camera);
  const scale = distance(camera) / focal(camera, height);
  const step = add(times(right, -dx * scale), times(down, -dy * scale));
  return {...camera, eye: add(camera.eye, step), target: add(camera.target, step)};
}

/** Comes nearer (factor < 1) to what is under `pixel` at the target's depth; the target stays `least` away. */
export function dolly(camera, factor, size, pixel, least) {
  const d = distance(camera);
  const {forward} = axes(camera);
  const eye = add(camera.eye, times(ray(camera, size, pixel), d * (1 - factor)));
  return {...camera, eye, target: add(eye, times(forward, Math.max(d * factor, least)))};
}

/** Looks at `target` from the same side as before. */
export const aim = (camera, target) => ({...camera, eye: add(camera.eye, sub(target, camera.target)), target});

/** How an image that `from` took has to be bent to stand for what `to` sees, if everything lay in the plane through the
 * target: a CSS matrix3d; "" where part of it falls behind the eye. */
export function warp(from, to, [width, height]) {
  const a = axes(from),
    b = axes(to);
  const [f, g, d] = [focal(from, height), focal(to, height), distance(from)];
  const [cx, cy] = [width / 2, height / 2];
  // Columns: what one pixel to the right, one pixel down, and pixel (0, 0) itself are in the world, from to.eye.
  const columns = [
    times(a.right, d / f),
    times(a.down, d / f),
    add(
      sub(from.eye, to.eye),
      add(times(a.forward, d), add(times(a.right, (-cx * d) / f), times(a.down, (-cy * d) / f))),
    ),
  ];
  const h = columns.map((v, i) => {
    const z = !to.flat ? dot(v, b.forward) : i === 2 ? distance(to) : 0;
    return [g * dot(v, b.right) + cx * z, g * dot(v, b.down) + cy * z, z];
  });
  const corners = [
    [0, 0],
    [width, 0],
    [0, height],
    [width, height],
  ];
  if (corners.some(([x, y]) => h[0][2] * x + h[1][2] * y + h[2][2] < 0.05 * d)) return "";
  const [a1, a2, a3] = h.map((column) => column.map((x) => x / h[2][2]));
  return `matrix3d(${[a1[0], a1[1], 0, a1[2], a2[0], a2[1], 0, a2[2], 0, 0, 1, 0, a3[0], a3[1], 0, 1]})`;
}

/** Coordinates rounded to what a pixel can tell at this distance. */
export function rounded(camera) {
  const digits = Math.min(12, Math.max(0, 4 - Math.floor(Math.log10(distance(camera)))));
  const round = (v) => v.map((x) => Number(x.toFixed(digits)) + 0);
  return {
    eye: round(camera.eye),
    target: round(camera.target),
    up: camera.up.map((x) => Number(x.toFixed(6)) + 0),
    fov: Number(camera.fov.toFixed(3)),
    ...(camera.flat ? {flat: true} : {}),
  };
}

/** What of it the service takes: of a flat one the eye is `back` farther away, so that nothing is before it. */
export function params({flat, fov, ...camera}, back) {
  if (!flat) return {...camera, fov};
  const height = 2 * distance(camera) * Math.tan((fov * Math.PI) / 360);
  const eye = sub(camera.eye, times(axes(camera).forward, back));
  return {...rounded({...camera, eye, fov: 1}), fov: undefined, projection: "orthographic", view_height: Number(height.toPrecision(6))};
}

/** The other way round: of parameters, with what they leave out from `home`, for a picture of so many rows. */
export function fromParams({projection, units_per_pixel: pixel, view_height: high, ...given}, home, rows) {
  const camera = {...home, ...given},
    height = pixel === undefined ? high : pixel * rows;
  if (projection !== "orthographic" && height === undefined) return camera;
  if (!given.up) camera.up = upOf(home, camera);
  const far = height ? height / 2 / Math.tan((camera.fov * Math.PI) / 360) : distance(camera);
  return {...camera, flat: true, eye: sub(camera.target, times(axes(camera).forward, far))};
}

/** Which of x, y, z is up: z unless it is y that is. */
export const upIndex = (home) => (Math.abs(home.up[1]) > Math.abs(home.up[2]) ? 1 : 2);

/** North of a plan. */
const northOf = (home) => cross([0, 0, 0].with(upIndex(home), 1), [1, 0, 0]);

/** What is up in a flat picture where nobody says, as the service has it: what is at home, but north where one looks along that. */
export function upOf(home, {eye, target}) {
  const forward = sub(target, eye),
    along = dot(forward, home.up);
  return along * along < dot(forward, forward) * dot(home.up, home.up) * (1 - 1e-12) ? home.up : northOf(home);
}

/** The same target from one of its sides ("top", "front", "side"), flat; `home` says what is up. */
export function fromSide(camera, side, home) {
  const x = [1, 0, 0],
    up = [0, 0, 0].with(upIndex(home), 1),
    north = northOf(home);
  const [direction, upward] = {top: [times(up, -1), north], front: [north, up], side: [times(x, -1), up]}[side];
  return {...camera, flat: true, up: upward, eye: sub(camera.target, times(direction, distance(camera)))};
}

export const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
