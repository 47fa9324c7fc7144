/* Range profiles and range-rate maps on canvases. Ranges are in m, closing speeds in m/s, levels in
   dBm; colours come from the style sheet. */
const CIVIDIS = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115],
  [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85], [254, 232, 56],
];
const MARK_REACH = 14; /* px within which the pointer is at a mark */
const SHAPES = { /* outlines of marks by their names in matplotlib */
  "o": "M5 0A5 5 0 1 1-5 0A5 5 0 1 1 5 0Z", ".": "M2.5 0A2.5 2.5 0 1 1-2.5 0A2.5 2.5 0 1 1 2.5 0Z",
  "s": "M-4-4H4V4H-4Z", "d": "M0-6L4 0L0 6L-4 0Z", "v": "M-5-4H5L0 5Z",
  "X": "M-4-4L4 4M-4 4L4-4", "P": "M-5 0H5M0-5V5",
};

const colourOf = (name) => (name.startsWith("#") ? name
  : getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
const fixed = (value, digits = 1) => (value === null ? "–" : value.toFixed(digits).replace("-", "−"));
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/* A pen that draws in CSS pixels, at the resolution of the screen. */
function prepared(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  Object.assign(pen, { font: "12px system-ui, sans-serif", lineJoin: "round", lineCap: "round" });
  return { pen, width, height };
}

/* Round numbers from low to high, about `most` at most. */
function ticks(low, high, most) {
  const power = 10 ** Math.floor(Math.log10((high - low) / most));
  const step = power * [1, 2, 5, 10].find((n) => n * power >= (high - low) / most);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, n) => (first + n) * step);
}

/* The axes of a plot: pixels of values, values of pixels, grid and labels. */
class PlotAxes {
  constructor(canvas, reach, y, yLabel) {
    const { pen, width, height } = prepared(canvas);
    Object.assign(this, { pen, x: [0, reach], y, left: 48, right: width - 12, top: 12, bottom: height - 40 });
    this.grid(yLabel);
  }

  px(x) { return this.left + ((x - this.x[0]) / (this.x[1] - this.x[0])) * (this.right - this.left); }
  py(y) { return this.bottom - ((y - this.y[0]) / (this.y[1] - this.y[0])) * (this.bottom - this.top); }
  xAt(px) { return this.x[0] + ((px - this.left) / (this.right - this.left)) * (this.x[1] - this.x[0]); }
  yAt(py) { return this.y[0] + ((this.bottom - py) / (this.bottom - this.top)) * (this.y[1] - this.y[0]); }

  grid(yLabel) {
    const { pen } = this;
    Object.assign(pen, { fillStyle: colourOf("soft"), textAlign: "center" });
    for (const x of ticks(...this.x, (this.right - this.left) / 70)) {
      this.line([[x, this.y[0]], [x, this.y[1]]], "line");
      pen.fillText(fixed(x, 0), this.px(x), this.bottom + 16);
    }
    pen.fillText("Range (m)", (this.left + this.right) / 2, this.bottom + 34);
    pen.textAlign = "right";
    for (const y of ticks(...this.y, (this.bottom - this.top) / 36)) {
      this.line([[this.x[0], y], [this.x[1], y]], "line");
      pen.fillText(fixed(y, 0), this.left - 6, this.py(y) + 4);
    }
    pen.save();
    pen.textAlign = "center";
    pen.translate(12, (this.top + this.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(yLabel, 0, 0);
    pen.restore();
  }

  line(points, colour, { width = 1, dashes = [] } = {}) {
    Object.assign(this.pen, { strokeStyle: colourOf(colour), lineWidth: width });
    this.pen.setLineDash(dashes);
    this.pen.beginPath();
    points.forEach(([x, y], n) => this.pen[n ? "lineTo" : "moveTo"](this.px(x), this.py(y)));
    this.pen.stroke();
    this.pen.setLineDash([]);
  }

  /* What `draw` draws does not leave the axes. */
  clipped(draw) {
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(this.left, this.top, this.right - this.left, this.bottom - this.top);
    this.pen.clip();
    draw();
    this.pen.restore();
  }

  /* Words beside a place, moved so far that the axes hold them. */
  text(words, x, y, { align = "left", colour = "ink", dx = 0, dy = 0 } = {}) {
    const { pen } = this;
    const wide = pen.measureText(words).width;
    const left = clamp(this.px(x) + dx - (align === "right" ? wide : 0), this.left + 2, this.right - 2 - wide);
    Object.assign(pen, { textAlign: "left", lineWidth: 4, strokeStyle: colourOf("card"), fillStyle: colourOf(colour) });
    pen.strokeText(words, left, this.py(y) + dy);
    pen.fillText(words, left, this.py(y) + dy);
  }

  curve(row, colour, width) {
    this.line(row.profile.range.map((range, n) => [range, row.profile.power[n]]), colour, { width });
  }

  /* Lines at the ranges of the targets; names are below each other where they would overlap. */
  targets(row) {
    let [end, below] = [-Infinity, 0];
    for (const target of [...row.targets].sort((a, b) => inProfile(a) - inProfile(b))) {
      const [{ name, found }, range] = [target, inProfile(target)];
      const [colour, words] = found ? ["good", name] : ["bad", `${name} (missed)`];
      this.line([[range, this.y[0]], [range, this.y[1]]], colour);
      below = this.px(range) < end ? below + 15 : 0;
      end = this.px(range) + this.pen.measureText(words).width + 10;
      this.text(words, range, this.y[1], { colour, dx: 5, dy: 14 + below });
    }
  }

  /* Marks of the detections at the x and y that `place` gives, as a list of places for the pointer. */
  marks(row, causes, place) {
    const spots = row.marks.map((mark) => {
      const [x, y] = place(mark);
      return { x: this.px(x), y: this.py(y), mark };
    });
    spots.forEach(({ x, y, mark }) => drawMark(this.pen, causes[mark.cause], x, y));
    return spots;
  }

  cursor(range, y) {
    this.line([[range, this.y[0]], [range, this.y[1]]], "ink", { dashes: [3, 3] });
    this.line([[range, y], [range, y]], "ink", { width: 7 });
  }
}

/* The mark of a cause at a place in px: empty for bodies, filled or crossed for ghosts. */
function drawMark(pen, { shape, colour, label }, x, y) {
  const path = new Path2D(SHAPES[shape]);
  const own = colour === "#222222" ? colourOf("ink") : colour;
  const [isCross, isGhost] = ["XP".includes(shape), label.startsWith("ghost")];
  pen.save();
  pen.translate(x, y);
  Object.assign(pen, { strokeStyle: colourOf("card"), fillStyle: own, lineWidth: isCross ? 6 : 3.5 });
  pen.stroke(path);
  if (isGhost && !isCross) pen.fill(path);
  Object.assign(pen, { strokeStyle: own, lineWidth: isCross ? 3 : isGhost ? 0 : 2 });
  if (!isGhost || isCross) pen.stroke(path);
  pen.restore();
}

/* The profile's power at the sample that is nearest to a range. */
function powerAt({ profile: { range: ranges, power } }, range) {
  const distance = (n) => Math.abs(ranges[n] - range);
  return power[ranges.reduce((best, _, n) => (distance(n) < distance(best) ? n : best), 0)];
}

/* Ends of a power axis for rows, in whole tens of dBm. */
function powerLimits(rows) {
  const powers = rows.flatMap((row) => row.profile.power);
  const noise = Math.min(...rows.map((row) => row.noise));
  const low = Math.min(Math.max(Math.min(...powers), noise - 20), noise);
  return [10 * Math.floor((low - 4) / 10), 10 * Math.ceil((Math.max(...powers) + 6) / 10)];
}

function drawNoise(axes, row) {
  axes.line([[axes.x[0], row.noise], [axes.x[1], row.noise]], "soft", { dashes: [2, 4] });
  axes.text("thermal noise", axes.x[1], row.noise, { align: "right", colour: "soft", dy: 15 });
}

/* The range profile of a row, with another one behind it if there is one. */
function drawProfile(canvas, row, { causes, behind, limits, cursor }) {
  const axes = new PlotAxes(canvas, row.reach, limits, "Power (dBm)");
  let spots = [];
  axes.clipped(() => {
    if (behind) axes.curve(behind, "faint", 1.6);
    drawNoise(axes, row);
    axes.targets(row);
    axes.curve(row, "accent", 1.8);
    const onCurve = (place) => [inProfile(place), powerAt(row, inProfile(place))];
    spots = axes.marks(row, causes, onCurve);
    if (cursor) axes.cursor(...onCurve(cursor));
  });
  return { axes, spots };
}

function cellsOf(map) {
  map.bytes ??= Uint8Array.from(atob(map.cells), (letter) => letter.charCodeAt(0));
  return map.bytes;
}

/* Level of the cell at a place, dBm. */
function levelAt(map, range, speed) {
  const index = (value, [low, high], count) =>
    clamp(Math.round(((value - low) / (high - low)) * (count - 1)), 0, count - 1);
  const [rates, ranges] = map.shape;
  const cell = index(speed, map.speed, rates) * ranges + index(range, map.range, ranges);
  return map.low + map.step * cellsOf(map)[cell];
}

/* A picture of all cells, one pixel each, the greatest closing speed on top. */
function mapPicture(map) {
  if (map.picture) return map.picture;
  const [height, width] = map.shape;
  const image = new ImageData(width, height);
  const low = Math.max(map.floor, map.top - 60);
  cellsOf(map).forEach((byte, n) => {
    const at = clamp((9 * (map.low + map.step * byte - low)) / (map.top - low), 0, 8.999);
    const [dark, bright] = [CIVIDIS[Math.floor(at)], CIVIDIS[Math.floor(at) + 1]];
    const colour = dark.map((part, k) => part + (bright[k] - part) * (at % 1));
    image.data.set([...colour, 255], 4 * ((height - 1 - Math.floor(n / width)) * width + (n % width)));
  });
  map.picture = Object.assign(document.createElement("canvas"), { width, height });
  map.picture.getContext("2d").putImageData(image, 0, 0);
  return map.picture;
}

/* Range at which a profile has a target, a detection or the pointer: its instant may differ from
   that of the map. */
const inProfile = ({ range, profile_range = range }) => profile_range;

/* Closing speed at which a map has a target, a detection or the pointer. */
const onMap = ({ speed, folded = speed }) => folded;

/* Power over range and closing speed, with targets as circles. */
function drawMap(canvas, row, { causes, cursor }) {
  const axes = new PlotAxes(canvas, row.reach, row.map.speed, "Closing speed (m/s)");
  const { pen, left, right, top, bottom } = axes;
  let spots = [];
  axes.clipped(() => {
    const [from, to] = row.map.range.map((range) => axes.px(range));
    pen.fillStyle = `rgb(${CIVIDIS[0]})`;
    pen.fillRect(left, top, right - left, bottom - top);
    pen.drawImage(mapPicture(row.map), from, top, to - from, bottom - top);
    Object.assign(pen, { strokeStyle: "#ffffff", lineWidth: 1.5 });
    for (const target of row.targets) {
      pen.beginPath();
      pen.arc(axes.px(target.range), axes.py(onMap(target)), 11, 0, 2 * Math.PI);
      pen.stroke();
    }
    spots = axes.marks(row, causes, (mark) => [mark.range, onMap(mark)]);
    if (cursor) axes.cursor(cursor.range, onMap(cursor));
  });
  return { axes, spots };
}

/* The picture at the top: two waveforms, the ghost, and the height of the floor over noise. */
function drawHeadline(canvas, conventional, diverse, ghost) {
  const axes = new PlotAxes(canvas, diverse.reach, powerLimits([conventional, diverse]), "Power (dBm)");
  const [x, top] = [23, powerAt(diverse, 23)];
  const arrow = (y, way) => axes.line([[x - 0.25, y + way], [x, y], [x + 0.25, y + way]], "ink", { width: 1.5 });
  axes.clipped(() => {
    drawNoise(axes, diverse);
    axes.targets(diverse);
    axes.curve(conventional, "bad", 1.8);
    axes.curve(diverse, "accent", 2.2);
    axes.line([[x, diverse.noise], [x, top]], "ink", { width: 1.5 });
    arrow(diverse.noise, 3);
    arrow(top, -3);
    axes.pen.font = "600 13px system-ui, sans-serif";
    axes.text(`+${fixed(top - diverse.noise, 0)} dB`, x, (top + diverse.noise) / 2, { dx: 9, dy: 4 });
    axes.text("equal slopes", 18, powerAt(conventional, 18), { colour: "bad", align: "right", dx: -10, dy: 26 });
    axes.text("diverse slopes", 18, powerAt(diverse, 18), { colour: "accent", dy: -14 });
    if (!ghost) return;
    const words = `ghost at ${fixed(ghost.range, 2)} m`;
    axes.text(words, ghost.range, powerAt(conventional, ghost.range), { colour: "bad", align: "right", dx: -12, dy: 4 });
  });
}
