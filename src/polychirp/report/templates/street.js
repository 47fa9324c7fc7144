/* The street in three dimensions: boxes, trees and beams by a painter's algorithm on a canvas. */

const SUN = [-0.45, -0.4, 0.8]; /* unit vector towards the sun */
const FACES = [ /* corners of a box, numbered by bits x, y, z; counter-clockwise from outside */
  [0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6],
];

const subtract = (a, b) => a.map((value, n) => value - b[n]);
const dot = (a, b) => a.reduce((sum, value, n) => sum + value * b[n], 0);
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const unit = (a) => a.map((value) => value / Math.hypot(...a));
const middleOf = (points) => [0, 1, 2].map((n) => points.reduce((s, p) => s + p[n], 0) / points.length);

/* The eight corners of a box in the world, from its corners in a body's own frame. */
function corners(body, low, high, taper = 0) {
  const [c, s] = [Math.cos(body.yaw), Math.sin(body.yaw)];
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) => {
    const isTop = n & 4;
    const inset = isTop ? taper : 0;
    const x = n & 1 ? high[0] - inset : low[0] + inset;
    const y = n & 2 ? high[1] - 0.4 * inset : low[1] + 0.4 * inset;
    return [body.place[0] + c * x - s * y, body.place[1] + s * x + c * y,
      body.place[2] + (isTop ? high[2] : low[2])];
  });
}

/* A body as convex boxes, the lowest first, with a bounding box in the world. */
function solid(body) {
  const { low, high } = body;
  const whole = corners(body, low, high);
  const bounds = [0, 1, 2].map((n) => [
    Math.min(...whole.map((p) => p[n])), Math.max(...whole.map((p) => p[n])),
  ]);
  const height = high[2] - low[2];
  const parts = [{ points: whole, colour: body.colour }];
  if (body.kind === "vehicle") {
    const belt = low[2] + 0.58 * height;
    const length = high[0] - low[0];
    const nose = height > 1.8 ? 0.12 : 0.26;
    const inner = [[low[0] + 0.1 * length, low[1] + 0.05, belt],
      [high[0] - nose * length, high[1] - 0.05, high[2]]];
    parts[0] = {
      points: corners(body, [low[0], low[1], low[2] + 0.12 * height], [high[0], high[1], belt]),
      colour: body.colour,
    };
    parts.push({ points: corners(body, ...inner, 0.32), colour: "#46525e", top: body.colour });
  }
  return { body, bounds, parts };
}

/* True if `a` must be drawn before `b`: a plane between them has the camera on the side of b. */
function isBehind(a, b, eye) {
  return a.bounds.some(([low, high], n) =>
    (high <= b.bounds[n][0] && eye[n] >= b.bounds[n][0]) ||
    (low >= b.bounds[n][1] && eye[n] <= b.bounds[n][1]));
}

/* Solids in the order in which they are drawn. */
function painted(solids, eye) {
  const left = [...solids];
  const order = [];
  while (left.length) {
    const free = left.findIndex((one) =>
      left.every((other) => other === one || !isBehind(other, one, eye) || isBehind(one, other, eye)));
    order.push(...left.splice(Math.max(free, 0), 1));
  }
  return order;
}

class StreetScene {
  constructor(figure, model) {
    this.canvas = figure.querySelector("canvas");
    this.model = model;
    this.solids = model.bodies.filter((body) => body.kind !== "road").map(solid);
    this.roads = model.bodies.filter((body) => body.kind === "road").map(solid);
    const cars = this.solids.filter((one) => one.body.kind === "vehicle");
    const seen = cars.length ? cars : this.solids;
    const span = [0, 1].map((n) => [
      Math.min(...seen.map((one) => one.bounds[n][0])), Math.max(...seen.map((one) => one.bounds[n][1])),
    ]);
    this.target = [...span.map(([low, high]) => (low + high) / 2), 0];
    this.start = { yaw: -2.45, pitch: 0.5, distance: 0.72 * Math.max(20, span[0][1] - span[0][0]) };
    Object.assign(this, this.start);
    this.listen();
    window.addEventListener("look", () => this.draw());
    this.draw();
  }

  listen() {
    let last = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      last = [event.clientX, event.clientY];
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turn(-0.008 * (event.clientX - last[0]), 0.006 * (event.clientY - last[1]));
      last = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) {
      this.canvas.addEventListener(end, () => { last = null; });
    }
    this.canvas.addEventListener("keydown", (event) => {
      const turns = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.06], ArrowDown: [0, -0.06] };
      if (turns[event.key]) this.turn(...turns[event.key]);
      else if ("+-".includes(event.key)) this.zoom(event.key === "+" ? 0.85 : 1 / 0.85);
      else if (event.key === "Home") this.reset();
      else return;
      event.preventDefault();
    });
    const buttons = { nearer: () => this.zoom(0.85), farther: () => this.zoom(1 / 0.85), reset: () => this.reset() };
    for (const button of this.canvas.parentElement.querySelectorAll("button")) {
      button.addEventListener("click", buttons[button.name]);
    }
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(1.5, Math.max(0.06, this.pitch + pitch));
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(200, Math.max(8, this.distance * factor));
    this.draw();
  }

  reset() {
    Object.assign(this, this.start);
    this.draw();
  }

  look() {
    const { pen, width, height } = prepared(this.canvas);
    const level = Math.cos(this.pitch) * this.distance;
    this.eye = [
      this.target[0] + level * Math.cos(this.yaw), this.target[1] + level * Math.sin(this.yaw),
      Math.max(0.5, Math.sin(this.pitch) * this.distance),
    ];
    const forward = unit(subtract(this.target, this.eye));
    const right = unit(cross(forward, [0, 0, 1]));
    Object.assign(this, { pen, width, height, forward, right, up: cross(right, forward) });
    this.scale = 0.95 * Math.max(width, height * 1.5);
  }

  project(point) {
    const away = subtract(point, this.eye);
    const depth = dot(away, this.forward);
    const scale = this.scale / depth;
    return { x: this.width / 2 + dot(away, this.right) * scale,
      y: this.height * 0.52 - dot(away, this.up) * scale, depth, scale };
  }

  /* Points of a polygon in front of the camera, cut where it passes the camera's plane. */
  cut(points) {
    const near = 0.5;
    const depth = points.map((point) => dot(subtract(point, this.eye), this.forward));
    return points.flatMap((point, n) => {
      const m = (n + 1) % points.length;
      const kept = depth[n] > near ? [point] : [];
      if ((depth[n] > near) !== (depth[m] > near)) {
        const share = (near - depth[n]) / (depth[m] - depth[n]);
        kept.push(point.map((value, k) => value + share * (points[m][k] - value)));
      }
      return kept;
    });
  }

  fill(points, colour, edge = null) {
    const shown = this.cut(points).map((point) => this.project(point));
    if (shown.length < 3) return;
    this.pen.beginPath();
    shown.forEach(({ x, y }, n) => this.pen[n ? "lineTo" : "moveTo"](x, y));
    this.pen.closePath();
    this.pen.fillStyle = colour;
    this.pen.fill();
    this.pen.strokeStyle = edge ?? colour;
    this.pen.lineWidth = 0.7;
    this.pen.stroke();
  }

  draw() {
    this.look();
    const sky = this.pen.createLinearGradient(0, 0, 0, this.height);
    sky.addColorStop(0, colourOf("sky"));
    sky.addColorStop(1, colourOf("haze"));
    this.pen.fillStyle = sky;
    this.pen.fillRect(0, 0, this.width, this.height);
    this.roads.forEach((one) => this.drawRoad(one.body));
    this.model.beams.forEach((beam) => this.drawBeam(beam));
    painted(this.solids, this.eye).forEach((one) => this.drawSolid(one));
    this.solids.filter((one) => one.body.kind === "vehicle").forEach((one) => this.drawName(one));
  }

  drawRoad(body) {
    const [, , , , a, b, d, c] = corners(body, body.low, body.high);
    this.fill([a, b, c, d], colourOf("asphalt"));
    const [low, high] = [body.low[0], body.high[0]];
    const y = (body.low[1] + body.high[1]) / 2;
    for (let x = low; x < high; x += 6) {
      const dash = corners(body, [x, y - 0.07, 0], [Math.min(x + 3, high), y + 0.07, 0.01]);
      this.fill([dash[4], dash[5], dash[7], dash[6]], colourOf("paint"));
    }
  }

  /* A sector on the road that fades away, since it shows a direction and no range. */
  drawBeam({ place, azimuth, half_width: half, colour }) {
    for (let ring = 1; ring <= 8; ring++) {
      const reach = 1.2 * ring;
      const points = [[place[0], place[1], 0.03]];
      for (let n = -12; n <= 12; n++) {
        const angle = azimuth + (half * n) / 12;
        points.push([place[0] + reach * Math.cos(angle), place[1] + reach * Math.sin(angle), 0.03]);
      }
      this.fill(points, `${colour}18`, "transparent");
    }
  }

  drawSolid(one) {
    if (one.body.kind === "tree") return this.drawTree(one);
    for (const part of one.parts) {
      for (const face of FACES) {
        const points = face.map((n) => part.points[n]);
        const normal = cross(subtract(points[1], points[0]), subtract(points[3], points[0]));
        const isSeen = dot(normal, subtract(this.eye, points[0])) > 0;
        const isFlat = Math.hypot(...normal) < 1e-6;
        if (!isSeen || isFlat) continue;
        const colour = part.top && face === FACES[5] ? part.top : part.colour;
        this.fill(points, this.lit(colour, unit(normal), this.opacity(one)), "rgba(0,0,0,0.3)");
      }
    }
    return undefined;
  }

  /* Houses before the street are transparent. */
  opacity({ body, bounds }) {
    if (body.kind !== "building") return 1;
    const middle = bounds.map(([low, high]) => (low + high) / 2);
    const side = [0, 1].map((n) => (middle[n] - this.target[n]) * (this.eye[n] - this.target[n]));
    return side[0] + side[1] > 0 ? 0.12 : 0.8;
  }

  lit(colour, normal, opacity) {
    const light = 0.62 + 0.38 * Math.max(0, dot(normal, SUN));
    const parts = [1, 3, 5].map((n) => parseInt(colour.slice(n, n + 2), 16));
    return `rgba(${parts.map((part) => Math.round(part * light))},${opacity})`;
  }

  drawTree({ body, bounds }) {
    const [x, y] = [0, 1].map((n) => (bounds[n][0] + bounds[n][1]) / 2);
    const radius = 0.5 * Math.max(bounds[0][1] - bounds[0][0], bounds[1][1] - bounds[1][0]);
    const crown = this.project([x, y, bounds[2][1] - radius]);
    const foot = this.project([x, y, 0]);
    if (crown.depth < 1 || foot.depth < 1) return;
    const { pen } = this;
    pen.strokeStyle = "#6b4d33";
    pen.lineWidth = Math.max(1, 0.25 * foot.scale);
    pen.beginPath();
    pen.moveTo(foot.x, foot.y);
    pen.lineTo(crown.x, crown.y);
    pen.stroke();
    const size = radius * crown.scale;
    const leaves = pen.createRadialGradient(
      crown.x - 0.35 * size, crown.y - 0.4 * size, 0.1 * size, crown.x, crown.y, size);
    leaves.addColorStop(0, "#7fae5e");
    leaves.addColorStop(1, body.colour);
    pen.fillStyle = leaves;
    pen.beginPath();
    pen.arc(crown.x, crown.y, size, 0, 2 * Math.PI);
    pen.fill();
  }

  drawName({ body, bounds }) {
    const roof = [...[0, 1].map((n) => (bounds[n][0] + bounds[n][1]) / 2), bounds[2][1]];
    const at = this.project(roof);
    if (at.depth < 1) return;
    const { pen } = this;
    const words = this.width > 560 ? `${body.name} · ${body.speed} km/h` : body.name;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    const half = pen.measureText(words).width / 2 + 6;
    const x = Math.min(Math.max(at.x, half), this.width - half);
    const y = at.y - 16;
    pen.fillStyle = colourOf("label");
    pen.beginPath();
    pen.rect(x - half, y - 13, 2 * half, 18);
    pen.fill();
    pen.fillStyle = colourOf("ink");
    pen.fillText(words, x, y);
  }
}

function startStreet(model) {
  const figure = document.getElementById("street");
  if (figure) window.street = new StreetScene(figure, model);
}
