// A view that turns about a point: azimuth and elevation [rad], distance [m], and the point [m, world], z up.

const FOV = 0.85;
const [NEAR, FAR] = [0.05, 60];

const add = (a, b) => a.map((x, k) => x + b[k]);
const times = (a, s) => a.map(x => x * s);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const limited = (x, low, high) => Math.min(Math.max(x, low), high);

export class View {
  constructor() {
    [this.azimuth, this.elevation, this.distance] = [-1.0, 0.16, 4.7];
    this.centre = [0, 0, 1.05];
    this.moved = false;
  }

  // Looks from the side at a tree and a robot beside it, unless somebody chose another view.
  face([x, y], aspect) {
    if (this.moved) return;
    this.distance = aspect < 1 ? 5.6 : 4.7;
    this.azimuth = Math.atan2(y, x) + 1.25;
    this.centre = [0.4 * x, 0.4 * y, 1.1];
  }

  // Unit vectors to the right, up, and forward.
  axes() {
    const [sa, ca] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    const [se, ce] = [Math.sin(this.elevation), Math.cos(this.elevation)];
    const forward = [-ca * ce, -sa * ce, -se], right = [-sa, ca, 0];
    return { right, up: cross(right, forward), forward };
  }

  eye() { return add(this.centre, times(this.axes().forward, -this.distance)); }

  // Half the height of the picture at distance 1. A narrow window sees as much to the sides as a square one.
  spread(aspect) { return Math.tan(FOV / 2) / Math.min(aspect, 1); }

  // Matrix from the world to clip space, column by column.
  clipWorld(aspect) {
    const { right, up, forward } = this.axes(), eye = this.eye(), s = this.spread(aspect);
    const [x, y] = [1 / (s * aspect), 1 / s];
    const [z, w] = [(FAR + NEAR) / (FAR - NEAR), -2 * FAR * NEAR / (FAR - NEAR)];
    const rows = [
      [...times(right, x), -x * dot(right, eye)],
      [...times(up, y), -y * dot(up, eye)],
      [...times(forward, z), -z * dot(forward, eye) + w],
      [...forward, -dot(forward, eye)],
    ];
    return new Float32Array([0, 1, 2, 3].flatMap(column => rows.map(row => row[column])));
  }

  // Ray through a place of the picture, -1 to 1 to the right and up.
  ray([x, y], aspect) {
    const { right, up, forward } = this.axes(), s = this.spread(aspect);
    const along = add(forward, add(times(right, x * s * aspect), times(up, y * s)));
    return { p: this.eye(), along: times(along, 1 / Math.hypot(...along)) };
  }

  // Place of a point in the picture, -1 to 1; null behind the eye.
  place(p, aspect) {
    const { right, up, forward } = this.axes(), s = this.spread(aspect);
    const d = add(p, times(this.eye(), -1)), depth = dot(d, forward);
    return depth > NEAR ? [dot(d, right) / (depth * s * aspect), dot(d, up) / (depth * s)] : null;
  }

  // Distance of a point along the view.
  depth(p) { return dot(add(p, times(this.eye(), -1)), this.axes().forward); }

  // The point of the ray through a place of the picture at a distance along the view.
  at(place, aspect, depth) {
    const { p, along } = this.ray(place, aspect);
    return add(p, times(along, depth / dot(along, this.axes().forward)));
  }

  // Keeps the eye above the ground.
  limit() {
    const lowest = Math.asin(limited((0.1 - this.centre[2]) / this.distance, -0.9, 0.9));
    this.elevation = limited(this.elevation, lowest, 1.5);
    this.moved = true;
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation += up;
    this.limit();
  }

  // Moves by a share of what is seen.
  move(right, up) {
    const axes = this.axes(), s = this.distance * 2 * Math.tan(FOV / 2);
    const moved = add(this.centre, add(times(axes.right, -right * s), times(axes.up, -up * s)));
    this.centre = [limited(moved[0], -6, 6), limited(moved[1], -6, 6), limited(moved[2], 0, 5)];
    this.limit();
  }

  zoom(factor) {
    this.distance = limited(this.distance * factor, 0.4, 16);
    this.limit();
  }
}
