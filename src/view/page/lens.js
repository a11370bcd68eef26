// Where a lens shows a point. Only what the page draws over a frame comes from here: the frame itself is traced by gart,
// with every term of every lens. Thin prism terms, which move a line by less than its width, are left out.

const tau = 2 * Math.PI;

export function kindOf(camera) {
  const model = camera.camera_model ?? 'PINHOLE';
  if (model === 'EQUIRECTANGULAR') return 'sphere';
  if (model.includes('FISHEYE')) return 'fisheye';
  if (model === 'FOV') return 'fov';
  if (model === 'EUCM') return 'eucm';
  if (model.includes('DIVISION')) return 'division';
  return 'perspective';
}

export const isPinhole = (camera) => ['PINHOLE', 'SIMPLE_PINHOLE'].includes(camera.camera_model ?? 'PINHOLE');

// A direction's distance from the axis at the angle theta, before radial terms; null outside the lens.
function distance(camera, kind, theta) {
  const s = Math.sin(theta), c = Math.cos(theta);
  if (kind === 'fisheye') return theta;
  if (kind === 'fov') return Math.atan2(2 * Math.tan(camera.omega / 2) * s, c) / camera.omega;
  if (kind === 'eucm') {
    const under = camera.alpha * Math.sqrt(camera.beta * s * s + c * c) + (1 - camera.alpha) * c;
    return under > 1e-6 ? s / under : null;
  }
  if (c < 1e-4 && kind === 'perspective') return null;
  const t = s / c, k = camera.k ?? camera.k1 ?? 0;
  if (kind === 'perspective' || k === 0) return c > 1e-4 ? t : null;
  // q / (1 + k q^2) = t, the root that begins at 0
  const root = c * c - 4 * k * s * s;
  return root >= 0 ? 2 * s / (c + Math.sqrt(root)) : null;
}

function radial(camera, kind, q2) {
  if (kind === 'division' || kind === 'fov' || kind === 'eucm') return 1;
  const model = camera.camera_model ?? 'PINHOLE';
  const of = (name) => camera[name] ?? 0;
  if (model === 'RAD_TAN_THIN_PRISM_FISHEYE')
    return 1 + q2 * (of('k0') + q2 * (of('k1') + q2 * (of('k2') + q2 * (of('k3') + q2 * (of('k4') + q2 * of('k5'))))));
  if (model === 'FULL_OPENCV')
    return (1 + q2 * (of('k1') + q2 * (of('k2') + q2 * of('k3')))) /
      (1 + q2 * (of('k4') + q2 * (of('k5') + q2 * of('k6'))));
  return 1 + q2 * ((camera.k ?? of('k1')) + q2 * (of('k2') + q2 * (of('k3') + q2 * of('k4'))));
}

// The pixel of a point in the camera's axes; null where it is not seen.
export function pixelOf(camera, [x, y, z]) {
  const kind = kindOf(camera), r = Math.hypot(x, y);
  if (kind === 'sphere') {
    const phi = Math.atan2(x, z), polar = Math.atan2(Math.hypot(x, z), -y);
    return [camera.width * (phi / tau + 0.5), camera.height * polar / Math.PI];
  }
  const q = distance(camera, kind, Math.atan2(r, z));
  if (q === null) return null;
  const shrink = r > 0 ? q / r : 0, q2 = q * q, d = radial(camera, kind, q2);
  const a = x * shrink, b = y * shrink;
  const p1 = camera.p1 ?? camera.p0 ?? 0, p2 = camera.p2 ?? 0;
  const u = a * d + 2 * p1 * a * b + p2 * (q2 + 2 * a * a), v = b * d + 2 * p2 * a * b + p1 * (q2 + 2 * b * b);
  return [(camera.fx ?? camera.f) * u + camera.cx, (camera.fy ?? camera.f) * v + camera.cy];
}

// Where pieces of a straight line have to be drawn by themselves, since the lens bends them.
export const piecesOf = (camera) => (isPinhole(camera) ? 1 : 12);
