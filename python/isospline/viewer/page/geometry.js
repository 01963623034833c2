// Vectors and the camera, with the formulas of isospline's cameras.

export const add = (a, b) => a.map((each, i) => each + b[i]);
export const subtract = (a, b) => a.map((each, i) => each - b[i]);
export const scale = (a, factor) => a.map(each => each * factor);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = a => Math.hypot(...a);
export const normalize = a => scale(a, 1 / (length(a) || 1));

export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

// A vector rotated counter-clockwise about a unit axis, by Rodrigues' formula.
export function turned(vector, axis, angle) {
  const along = scale(axis, dot(axis, vector));
  const across = subtract(vector, along);
  return add(along, add(scale(across, Math.cos(angle)), scale(cross(axis, vector), Math.sin(angle))));
}

// Right, up and forward of a camera, unit vectors.
export function basis(camera) {
  const forward = normalize(subtract(camera.target, camera.eye));
  const right = normalize(cross(forward, camera.up));
  return {right, up: cross(right, forward), forward};
}

export const distanceOf = camera => length(subtract(camera.target, camera.eye));

// The height of the picture at the target, in world units.
export function heightOf(camera) {
  if (camera.projection === "orthographic") return camera.height;
  return 2 * distanceOf(camera) * Math.tan(camera.field_of_view * Math.PI / 360);
}

// Pixels of a length of 1 across the picture, at a depth.
export const pixelsPerUnit = (camera, depth, height) =>
  height / (camera.projection === "perspective" ? 2 * depth * Math.tan(camera.field_of_view * Math.PI / 360) : camera.height);

// The pixel position and the depth of a point; null if it is behind the eye.
export function project(camera, point, width, height) {
  const {right, up, forward} = basis(camera);
  const offset = subtract(point, camera.eye);
  const depth = dot(offset, forward);
  if (camera.projection === "perspective" && depth <= 0) return null;
  const pixels = pixelsPerUnit(camera, depth, height);
  return [width / 2 + dot(offset, right) * pixels, height / 2 - dot(offset, up) * pixels, depth];
}

// The camera orbited by angles about the world's z axis and about its own right axis; it stops at the poles.
export function orbited(camera, sideways, downwards) {
  const axis = [0, 0, 1];
  const offset = turned(subtract(camera.eye, camera.target), axis, sideways);
  const up = turned(basis(camera).up, axis, sideways);
  const right = normalize(cross(up, offset));
  const elevation = Math.asin(clamp(normalize(offset)[2], -1, 1));
  const angle = elevation - clamp(elevation - downwards, -Math.PI / 2, Math.PI / 2);
  return {...camera, eye: add(camera.target, turned(offset, right, angle)), up: turned(up, right, angle)};
}

// The camera moved across the picture, by fractions of its height.
export function panned(camera, right, up) {
  const axes = basis(camera), span = heightOf(camera);
  const move = add(scale(axes.right, -right * span), scale(axes.up, -up * span));
  return {...camera, eye: add(camera.eye, move), target: add(camera.target, move)};
}

// The camera moved nearer to its target (factor < 1) or farther from it.
export function zoomed(camera, factor) {
  const offset = subtract(camera.eye, camera.target);
  return {...camera, height: camera.height * factor,
    eye: camera.projection === "perspective" ? add(camera.target, scale(offset, factor)) : camera.eye};
}

// The same for a point of the picture that stays where it is: `right` and `up` are its distances from the middle, in
// heights of the picture.
export const zoomedAt = (camera, factor, right, up) => zoomed(panned(camera, right * (factor - 1), up * (factor - 1)), factor);

// The camera with another projection; the target keeps its size in the picture.
export function withProjection(camera, projection) {
  const height = heightOf(camera), offset = subtract(camera.eye, camera.target);
  const distance = height / (2 * Math.tan(camera.field_of_view * Math.PI / 360));
  const eye = projection === "perspective" ? add(camera.target, scale(normalize(offset), distance)) : camera.eye;
  return {...camera, projection, height, eye};
}
