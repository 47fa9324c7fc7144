/* The street in three dimensions: boxes, trees and beams by a painter's algorithm on a canvas. */
const SUN = [-0.45, -0.4, 0.8]; /* unit vector towards the sun */
const NEAREST = 0.5; /* m before the camera, from which on bodies are drawn */
const FACES = [ /* corners of a box, numbered by bits x, y, z; counter-clockwise from outside */
  [0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6],
];
const TOP = FACES[5];

const subtract = (a, b) => a.map((value, n) => value - b[n]);
const dot = (a, b) => a.reduce((sum, value, n) => sum + value * b[n], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((value) => value / Math.hypot(...a));
const mean = ([low, high]) => (low + high) / 2;

/* The corners of a box in the world; its top is narrower by `taper`. */
function corners({ place, yaw }, low, high, taper = 0) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) => {
    const inset = n & 4 ? taper : 0;
    const x = n & 1 ? high[0] - inset : low[0] + inset;
    const y = n & 2 ? high[1] - 0.4 * inset : low[1] + 0.4 * inset;
    return [place[0] + c * x - s * y, place[1] + s * x + c * y, place[2] + (n & 4 ? high[2] : low[2])];
  });
}

/* A body as convex boxes, the lowest first, with its bounds in the world. */
function solid(body) {
  const { low, high, colour } = body;
  const whole = corners(body, low, high);
  const bounds = [0, 1, 2].map((n) => [Math.min, Math.max].map((end) => end(...whole.map((p) => p[n]))));
  if (body.kind !== "vehicle") return { body, bounds, parts: [{ points: whole, colour }] };
  const [length, height] = [high[0] - low[0], high[2] - low[2]];
  const belt = low[2] + 0.58 * height;
  const nose = (height > 1.8 ? 0.12 : 0.26) * length; /* vans have short ones */
  const hull = corners(body, [low[0], low[1], low[2] + 0.12 * height], [high[0], high[1], belt]);
  const from = [low[0] + 0.1 * length, low[1] + 0.05, belt];
  const cabin = corners(body, from, [high[0] - nose, high[1] - 0.05, high[2]], 0.32);
  return { body, bounds, parts: [{ points: hull, colour }, { points: cabin, colour: "#46525e", roof: colour }] };
}

/* True if a plane parallel to two axes has `b` and the camera on one side, and `a` on the other. */
const isBehind = (a, b, eye) => a.bounds.some(([low, high], n) =>
  (high <= b.bounds[n][0] && eye[n] >= b.bounds[n][0]) || (low >= b.bounds[n][1] && eye[n] <= b.bounds[n][1]));

/* Solids in the order in which they are drawn: first those behind which none of the rest is. */
function painted(solids, eye) {
  const [rest, order] = [[...solids], []];
  while (rest.length) {
    const free = rest.findIndex((one) =>
      rest.every((other) => other === one || !isBehind(other, one, eye) || isBehind(one, other, eye)));
    order.push(...rest.splice(Math.max(free, 0), 1));
  }
  return order;
}

class StreetScene {
  constructor(figure, { bodies, beams }) {
    const solids = bodies.map(solid);
    Object.assign(this, {
      canvas: figure.querySelector("canvas"), beams,
      roads: bodies.filter((body) => body.kind === "road"),
      solids: solids.filter((one) => one.body.kind !== "road"),
    });
    this.named = this.solids.filter((one) => ["vehicle", "object"].includes(one.body.kind));
    const seen = this.named.length ? this.named : solids;
    const span = [0, 1].map((n) => [Math.min(...seen.map((one) => one.bounds[n][0])),
      Math.max(...seen.map((one) => one.bounds[n][1]))]);
    const size = span.map(([low, high]) => high - low);
    this.across = size[0] > size[1] ? 1 : 0;
    this.target = [...span.map(mean), 0];
    this.first = { yaw: -2.3, pitch: 0.5, distance: 0.85 * Math.max(20, ...size) };
    this.listen(figure);
    window.addEventListener("look", () => this.draw());
    this.move(this.first);
  }

  listen(figure) {
    let last = null;
    const on = (name, act) => this.canvas.addEventListener(name, act);
    on("pointerdown", (event) => {
      last = event;
      this.canvas.setPointerCapture(event.pointerId);
    });
    on("pointermove", (event) => {
      if (last) this.turn(-0.008 * (event.clientX - last.clientX), 0.006 * (event.clientY - last.clientY));
      last = last && event;
    });
    ["pointerup", "pointercancel"].forEach((name) => on(name, () => { last = null; }));
    const acts = {
      "ArrowLeft": () => this.turn(0.1, 0), "ArrowRight": () => this.turn(-0.1, 0),
      "ArrowUp": () => this.turn(0, 0.06), "ArrowDown": () => this.turn(0, -0.06),
      "+": () => this.move({ distance: 0.85 * this.distance }),
      "-": () => this.move({ distance: this.distance / 0.85 }), "Home": () => this.move(this.first),
    };
    on("keydown", (event) => {
      if (acts[event.key]) event.preventDefault();
      acts[event.key]?.();
    });
    figure.querySelectorAll("button").forEach((button) => button.addEventListener("click", acts[button.value]));
  }

  turn(yaw, pitch) { this.move({ yaw: this.yaw + yaw, pitch: this.pitch + pitch }); }

  move(changes) {
    Object.assign(this, changes);
    this.pitch = clamp(this.pitch, 0.06, 1.5);
    this.distance = clamp(this.distance, 8, 200);
    this.draw();
  }

  look() {
    const level = Math.cos(this.pitch) * this.distance;
    const away = [level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(this.pitch) * this.distance];
    this.eye = this.target.map((value, n) => value + away[n]);
    this.forward = unit(subtract(this.target, this.eye));
    this.right = unit(cross(this.forward, [0, 0, 1]));
    this.up = cross(this.right, this.forward);
    Object.assign(this, prepared(this.canvas));
  }

  project(point) {
    const away = subtract(point, this.eye);
    const depth = dot(away, this.forward);
    const scale = (0.95 * Math.max(this.width, 1.5 * this.height)) / depth; /* px per m */
    const [x, y] = [this.width / 2 + dot(away, this.right) * scale, 0.52 * this.height - dot(away, this.up) * scale];
    return { x, y, depth, scale };
  }

  /* The part of a polygon that is at least `NEAREST` before the camera. */
  cut(points) {
    const depth = points.map((point) => dot(subtract(point, this.eye), this.forward) - NEAREST);
    return points.flatMap((point, n) => {
      const m = (n + 1) % points.length;
      const kept = depth[n] > 0 ? [point] : [];
      if (depth[n] > 0 === depth[m] > 0) return kept;
      const share = depth[n] / (depth[n] - depth[m]);
      return [...kept, point.map((value, k) => value + share * (points[m][k] - value))];
    });
  }

  fill(points, fillStyle, strokeStyle = fillStyle) {
    Object.assign(this.pen, { fillStyle, strokeStyle, lineWidth: 0.7 });
    this.pen.beginPath();
    this.cut(points).map((point) => this.project(point)).forEach(({ x, y }) => this.pen.lineTo(x, y));
    this.pen.closePath();
    this.pen.fill();
    this.pen.stroke();
  }

  draw() {
    this.look();
    const sky = this.pen.createLinearGradient(0, 0, 0, this.height);
    ["sky", "haze"].forEach((name, n) => sky.addColorStop(n, colourOf(name)));
    this.pen.fillStyle = sky;
    this.pen.fillRect(0, 0, this.width, this.height);
    this.roads.forEach((body) => this.drawRoad(body));
    this.beams.forEach((beam) => this.drawBeam(beam));
    for (const one of painted(this.solids, this.eye)) this[one.body.kind === "tree" ? "drawTree" : "drawBoxes"](one);
    this.named.forEach((one) => this.drawName(one));
  }

  drawRoad(body) {
    const level = (low, high) => TOP.map((n) => corners(body, low, high)[n]);
    const [[x0, y0], [x1, y1]] = [body.low, body.high];
    this.fill(level(body.low, body.high), colourOf("asphalt"));
    const middle = mean([y0, y1]);
    for (let x = x0; x < x1; x += 6) {
      this.fill(level([x, middle - 0.07, 0], [Math.min(x + 3, x1), middle + 0.07, 0.01]), colourOf("paint"));
    }
  }

  /* A sector on the road that fades away, since it shows a direction and no range. */
  drawBeam({ place: [x, y], azimuth, half_width: half, colour }) {
    for (let reach = 1.2; reach < 10; reach += 1.2) {
      const arc = Array.from({ length: 25 }, (_, n) => azimuth + half * (n / 12 - 1));
      const edge = arc.map((angle) => [x + reach * Math.cos(angle), y + reach * Math.sin(angle), 0.03]);
      this.fill([[x, y, 0.03], ...edge], `${colour}18`, "transparent");
    }
  }

  drawBoxes(one) {
    for (const { points, colour, roof = colour } of one.parts) {
      for (const face of FACES) {
        const [a, b, c, d] = face.map((n) => points[n]);
        const normal = cross(subtract(b, a), subtract(d, a));
        if (dot(normal, subtract(this.eye, a)) <= 1e-9) continue;
        const light = 0.62 + 0.38 * Math.max(0, dot(unit(normal), SUN));
        const paint = face === TOP ? roof : colour;
        const parts = [1, 3, 5].map((n) => Math.round(light * parseInt(paint.slice(n, n + 2), 16)));
        this.fill([a, b, c, d], `rgba(${parts},${this.opacity(one)})`, "rgba(0,0,0,0.3)");
      }
    }
  }

  /* Houses between the camera and the street are transparent. */
  opacity({ body, bounds }) {
    const [n, eye] = [this.across, this.eye];
    const isBetween = (mean(bounds[n]) - this.target[n]) * (eye[n] - this.target[n]) > 0;
    return body.kind === "building" && isBetween ? 0.12 : 1;
  }

  drawTree({ body, bounds: [bx, by, bz] }) {
    const radius = 0.5 * Math.max(bx[1] - bx[0], by[1] - by[0]);
    const [x, y] = [mean(bx), mean(by)];
    const [crown, foot] = [bz[1] - radius, bz[0]].map((z) => this.project([x, y, z]));
    if (Math.min(crown.depth, foot.depth) < NEAREST) return;
    const { pen } = this;
    Object.assign(pen, { strokeStyle: "#6b4d33", lineWidth: 0.25 * foot.scale });
    pen.beginPath();
    pen.moveTo(foot.x, foot.y);
    pen.lineTo(crown.x, crown.y);
    pen.stroke();
    const size = radius * crown.scale;
    const light = [crown.x - 0.35 * size, crown.y - 0.4 * size, 0.1 * size];
    pen.fillStyle = pen.createRadialGradient(...light, crown.x, crown.y, size);
    ["#7fae5e", body.colour].forEach((colour, n) => pen.fillStyle.addColorStop(n, colour));
    pen.beginPath();
    pen.arc(crown.x, crown.y, size, 0, 2 * Math.PI);
    pen.fill();
  }

  drawName({ body, bounds: [bx, by, bz] }) {
    const roof = this.project([mean(bx), mean(by), bz[1]]);
    if (roof.depth < NEAREST) return;
    const words = this.width > 560 ? `${body.name} · ${body.speed} km/h` : body.name;
    const half = this.pen.measureText(words).width / 2 + 6;
    const x = clamp(roof.x, half, this.width - half);
    Object.assign(this.pen, { fillStyle: colourOf("label"), textAlign: "center" });
    this.pen.fillRect(x - half, roof.y - 29, 2 * half, 18);
    this.pen.fillStyle = colourOf("ink");
    this.pen.fillText(words, x, roof.y - 16);
  }
}
