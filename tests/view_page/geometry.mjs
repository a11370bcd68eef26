// What the tests hold the page's cameras against, written down apart from it.

export const column = (c2w, k) => [c2w[0][k], c2w[1][k], c2w[2][k]];
export const placeOf = (camera) => column(camera.c2w, 3);
export const forwardOf = (camera) => column(camera.c2w, 2);
export const along = (a, d, t) => a.map((x, i) => x + t * d[i]);
export const minus = (a, b) => a.map((x, i) => x - b[i]);
export const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
export const length = (a) => Math.sqrt(dot(a, a));
export const apart = (a, b) => length(minus(a, b));

// A pinhole's pixel of a point of the world.
export function pixelOf(camera, point) {
  const d = minus(point, placeOf(camera));
  const [x, y, z] = [0, 1, 2].map((k) => dot(d, column(camera.c2w, k)));
  return [camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy, z];
}

// Right, down and forward at right angles and of length 1, right-handed.
export function isRotation(camera, within = 1e-9) {
  const [r, d, f] = [0, 1, 2].map((k) => column(camera.c2w, k));
  const cross = [r[1] * d[2] - r[2] * d[1], r[2] * d[0] - r[0] * d[2], r[0] * d[1] - r[1] * d[0]];
  return apart(cross, f) < within && Math.abs(length(r) - 1) < within && Math.abs(dot(r, d)) < within;
}

// A splat PLY of round, opaque Gaussians of SH degree 0: [x, y, z, radius, [r, g, b], features] each.
export function splatPly(gaussians) {
  const features = (gaussian) => gaussian[5] ?? [];
  const names = ['x', 'y', 'z', 'f_dc_0', 'f_dc_1', 'f_dc_2', 'opacity', 'scale_0', 'scale_1', 'scale_2', 'rot_0', 'rot_1',
    'rot_2', 'rot_3', ...features(gaussians[0]).map((_, i) => `feature_${i}`)];
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${gaussians.length}\n` +
    names.map((name) => `property float ${name}\n`).join('') + 'end_header\n';
  const body = Buffer.alloc(4 * names.length * gaussians.length);
  gaussians.forEach((gaussian, i) => {
    const [x, y, z, radius, color] = gaussian;
    const s = Math.log(radius), dc = color.map((c) => (c - 0.5) / 0.28209479177387814);
    [x, y, z, ...dc, 8, s, s, s, 1, 0, 0, 0, ...features(gaussian)].forEach((v, k) => body.writeFloatLE(v, 4 * (i * names.length + k)));
  });
  return Buffer.concat([Buffer.from(head), body]);
}
