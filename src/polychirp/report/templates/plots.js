/* Range profiles and range-rate maps on canvases. Places are ranges in m and speeds in m/s, levels
   are in dBm. */

const CIVIDIS = [
  [0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109], [112, 113, 115],
  [138, 134, 120], [165, 156, 116], [195, 179, 105], [225, 204, 85], [254, 232, 56],
];
const MARK_REACH = 14; /* px within which the pointer is at a mark */

const colourOf = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const fixed = (value, digits = 1) =>
  value === null ? "–" : value.toFixed(digits).replace("-", "−");

/* The canvas at the resolution of the screen; its pen draws in CSS pixels. */
function prepared(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  pen.font = "12px system-ui, sans-serif";
  pen.lineJoin = "round";
  return { pen, width, height };
}

/* Round numbers from low to high, at most about `most`. */
function ticks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= rough);
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9; n++) found.push(n * step);
  return found;
}

/* The axes of a plot: pixels of values, values of pixels, grid and labels. */
class PlotAxes {
  constructor(canvas, x, y) {
    const { pen, width, height } = prepared(canvas);
    Object.assign(this, { pen, x, y });
    this.left = 48;
    this.right = width - 12;
    this.top = 12;
    this.bottom = height - 40;
  }

  px(x) {
    return this.left + ((x - this.x[0]) / (this.x[1] - this.x[0])) * (this.right - this.left);
  }

  py(y) {
    return this.bottom - ((y - this.y[0]) / (this.y[1] - this.y[0])) * (this.bottom - this.top);
  }

  xAt(pixel) {
    return this.x[0] + ((pixel - this.left) / (this.right - this.left)) * (this.x[1] - this.x[0]);
  }

  yAt(pixel) {
    return this.y[0] + ((this.bottom - pixel) / (this.bottom - this.top)) * (this.y[1] - this.y[0]);
  }

  grid(xLabel, yLabel) {
    const { pen } = this;
    pen.strokeStyle = colourOf("line");
    pen.fillStyle = colourOf("soft");
    pen.lineWidth = 1;
    pen.textAlign = "center";
    for (const x of ticks(...this.x, (this.right - this.left) / 70)) {
      this.line([[x, this.y[0]], [x, this.y[1]]]);
      pen.fillText(fixed(x, 0), this.px(x), this.bottom + 16);
    }
    pen.textAlign = "right";
    for (const y of ticks(...this.y, (this.bottom - this.top) / 36)) {
      this.line([[this.x[0], y], [this.x[1], y]]);
      pen.fillText(fixed(y, 0), this.left - 6, this.py(y) + 4);
    }
    pen.textAlign = "center";
    pen.fillText(xLabel, (this.left + this.right) / 2, this.bottom + 34);
    pen.save();
    pen.translate(12, (this.top + this.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(yLabel, 0, 0);
    pen.restore();
  }

  line(points, dashes = []) {
    const { pen } = this;
    pen.setLineDash(dashes);
    pen.beginPath();
    points.forEach(([x, y], n) => pen[n ? "lineTo" : "moveTo"](this.px(x), this.py(y)));
    pen.stroke();
    pen.setLineDash([]);
  }

  /* What is drawn by `draw` does not leave the axes. */
  clipped(draw) {
    const { pen } = this;
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top, this.right - this.left, this.bottom - this.top);
    pen.clip();
    draw();
    pen.restore();
  }

  text(words, x, y, { align = "left", colour = "ink", dx = 0, dy = 0 } = {}) {
    const { pen } = this;
    pen.textAlign = align;
    const wide = pen.measureText(words).width;
    const from = { left: 0, center: -wide / 2, right: -wide }[align];
    const least = this.left + 2 - from;
    const most = this.right - 2 - from - wide;
    const at = Math.min(Math.max(this.px(x) + dx, least), most);
    pen.lineWidth = 4;
    pen.strokeStyle = colourOf("card");
    pen.strokeText(words, at, this.py(y) + dy);
    pen.fillStyle = colour.startsWith("#") ? colour : colourOf(colour);
    pen.fillText(words, at, this.py(y) + dy);
  }
}

/* Index of the value of an ascending list that is nearest to a value. */
function nearest(list, value) {
  let low = 0;
  let high = list.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (list[middle] < value) low = middle;
    else high = middle;
  }
  return value - list[low] < list[high] - value ? low : high;
}

const powerAt = (row, range) => row.profile.power[nearest(row.profile.range, range)];

/* A power axis for rows, in whole tens of dBm. */
function powerLimits(rows) {
  const powers = rows.flatMap((row) => row.profile.power);
  const noise = Math.min(...rows.map((row) => row.noise));
  const low = Math.min(Math.max(Math.min(...powers), noise - 20), noise);
  return [10 * Math.floor((low - 4) / 10), 10 * Math.ceil((Math.max(...powers) + 6) / 10)];
}

function drawCurve(axes, row, colour, width) {
  axes.pen.strokeStyle = colour;
  axes.pen.lineWidth = width;
  axes.line(row.profile.range.map((range, n) => [range, row.profile.power[n]]));
}

function drawLevel(axes, level, words) {
  axes.pen.strokeStyle = colourOf("soft");
  axes.pen.lineWidth = 1;
  axes.line([[axes.x[0], level], [axes.x[1], level]], [2, 4]);
  axes.text(words, axes.x[1], level, { align: "right", colour: "soft", dy: 15 });
}

const markColour = (cause) => (cause.colour === "#222222" ? colourOf("ink") : cause.colour);

/* The mark of a detection at a place in px, filled for ghosts and empty for bodies. */
function drawMark(pen, cause, x, y, size = 5) {
  const shape = cause.shape;
  const colour = markColour(cause);
  pen.beginPath();
  if (shape === "X" || shape === "P") {
    const turned = shape === "X" ? size * 0.8 : 0;
    const arms = shape === "X" ? [[1, 1], [1, -1]] : [[1, 0], [0, 1]];
    for (const [a, b] of arms) {
      const reach = turned || size * 1.1;
      pen.moveTo(x - a * reach, y - b * reach);
      pen.lineTo(x + a * reach, y + b * reach);
    }
    pen.lineCap = "round";
    for (const [stroke, width] of [[colourOf("card"), 6], [colour, 3]]) {
      pen.strokeStyle = stroke;
      pen.lineWidth = width;
      pen.stroke();
    }
    return;
  }
  if (shape === "s") pen.rect(x - size * 0.8, y - size * 0.8, size * 1.6, size * 1.6);
  else if (shape === "d" || shape === "v") {
    const top = shape === "v" ? [[-1, -0.8], [1, -0.8], [0, 1]] : [[0, -1.3], [0.8, 0], [0, 1.3], [-0.8, 0]];
    top.forEach(([a, b], n) => pen[n ? "lineTo" : "moveTo"](x + a * size, y + b * size));
    pen.closePath();
  } else pen.arc(x, y, shape === "." ? 2.5 : size, 0, 2 * Math.PI);
  const isBody = shape === "o" || cause.label === "another body";
  pen.strokeStyle = isBody ? colour : colourOf("card");
  pen.lineWidth = isBody ? 2 : 1;
  pen.fillStyle = colour;
  if (!isBody) pen.fill();
  pen.stroke();
}

/* Marks of detections at the y that `place` gives, and the list of their pixels for the pointer. */
function drawMarks(axes, row, causes, place) {
  const spots = [];
  for (const mark of row.marks) {
    const y = place(mark);
    const spot = { x: axes.px(mark.range), y: axes.py(y), mark };
    if (mark.range > axes.x[1] || y < axes.y[0] || y > axes.y[1]) continue;
    drawMark(axes.pen, causes[mark.cause], spot.x, spot.y);
    spots.push(spot);
  }
  return spots;
}

function drawTargets(axes, row) {
  let lastEnd = -Infinity;
  let line = 0;
  for (const target of [...row.targets].sort((a, b) => a.range - b.range)) {
    if (target.range > axes.x[1]) continue;
    axes.pen.strokeStyle = colourOf(target.found ? "good" : "bad");
    axes.pen.lineWidth = 1.2;
    axes.line([[target.range, axes.y[0]], [target.range, axes.y[1]]]);
    const words = `${target.name}${target.found ? "" : " (missed)"}`;
    line = axes.px(target.range) < lastEnd ? line + 1 : 0;
    lastEnd = axes.px(target.range) + axes.pen.measureText(words).width + 10;
    axes.text(words, target.range, axes.y[1], {
      colour: target.found ? "good" : "bad", dx: 5, dy: 14 + 15 * line,
    });
  }
}

/* The range profile of a row, with another one behind it if there is one. */
function drawProfile(canvas, row, { causes, behind = null, limits, cursor = null }) {
  const axes = new PlotAxes(canvas, [0, 30], limits);
  axes.grid("Range (m)", "Power (dBm)");
  let spots = [];
  axes.clipped(() => {
    if (behind) drawCurve(axes, behind, colourOf("faint"), 1.6);
    drawLevel(axes, row.noise, "thermal noise");
    drawTargets(axes, row);
    drawCurve(axes, row, colourOf("accent"), 1.8);
    spots = drawMarks(axes, row, causes, (mark) => powerAt(row, mark.range));
    if (cursor) drawCursor(axes, cursor, powerAt(row, cursor.range));
  });
  return { axes, spots };
}

function drawCursor(axes, cursor, y) {
  axes.pen.strokeStyle = colourOf("ink");
  axes.pen.lineWidth = 1;
  axes.line([[cursor.range, axes.y[0]], [cursor.range, axes.y[1]]], [3, 3]);
  if (y === null) return;
  axes.pen.fillStyle = colourOf("ink");
  axes.pen.beginPath();
  axes.pen.arc(axes.px(cursor.range), axes.py(y), 3.5, 0, 2 * Math.PI);
  axes.pen.fill();
}

const mapCells = (map) => {
  map.bytes ??= Uint8Array.from(atob(map.cells), (letter) => letter.charCodeAt(0));
  return map.bytes;
};

/* Level of the cell at a place, dBm. */
function levelAt(map, range, speed) {
  const [rates, ranges] = map.shape;
  const share = (value, [low, high], count) =>
    Math.min(count - 1, Math.max(0, Math.round(((value - low) / (high - low)) * (count - 1))));
  const cell = share(speed, map.speed, rates) * ranges + share(range, map.range, ranges);
  return map.low + map.step * mapCells(map)[cell];
}

/* A picture of all cells, one pixel each, the greatest closing speed on top. */
function mapPicture(map) {
  if (map.picture) return map.picture;
  const [rates, ranges] = map.shape;
  const picture = document.createElement("canvas");
  picture.width = ranges;
  picture.height = rates;
  const pen = picture.getContext("2d");
  const image = pen.createImageData(ranges, rates);
  const cells = mapCells(map);
  const low = Math.max(map.floor, map.top - 60);
  for (let n = 0; n < cells.length; n++) {
    const share = (map.low + map.step * cells[n] - low) / (map.top - low);
    const at = Math.min(8.999, Math.max(0, 9 * share));
    const [a, b] = [CIVIDIS[Math.floor(at)], CIVIDIS[Math.floor(at) + 1]];
    const from = (rates - 1 - Math.floor(n / ranges)) * ranges + (n % ranges);
    for (let k = 0; k < 3; k++) image.data[4 * from + k] = a[k] + (b[k] - a[k]) * (at % 1);
    image.data[4 * from + 3] = 255;
  }
  pen.putImageData(image, 0, 0);
  map.picture = picture;
  return picture;
}

/* Power over range and closing speed, with targets as circles. */
function drawMap(canvas, row, { causes, cursor = null }) {
  const { map } = row;
  const axes = new PlotAxes(canvas, [0, 30], map.speed);
  let spots = [];
  axes.clipped(() => {
    const [left, right] = map.range.map((range) => axes.px(range));
    axes.pen.fillStyle = `rgb(${CIVIDIS[0]})`;
    axes.pen.fillRect(axes.left, axes.top, axes.right - axes.left, axes.bottom - axes.top);
    axes.pen.drawImage(mapPicture(map), left, axes.top, right - left, axes.bottom - axes.top);
    axes.pen.strokeStyle = "#ffffff";
    axes.pen.lineWidth = 1.5;
    for (const target of row.targets) {
      axes.pen.beginPath();
      axes.pen.arc(axes.px(target.range), axes.py(target.speed), 11, 0, 2 * Math.PI);
      axes.pen.stroke();
    }
    spots = drawMarks(axes, row, causes, (mark) => mark.speed);
    if (cursor) drawCursor(axes, cursor, cursor.speed);
  });
  drawFrame(axes);
  return { axes, spots };
}

/* Ticks and labels beside a map; a grid would hide cells. */
function drawFrame(axes) {
  const { pen } = axes;
  const whole = [axes.left, axes.top, axes.right - axes.left, axes.bottom - axes.top];
  pen.save();
  pen.beginPath();
  pen.rect(0, 0, axes.right + 12, axes.bottom + 40);
  pen.rect(...whole);
  pen.clip("evenodd");
  axes.grid("Range (m)", "Closing speed (m/s)");
  pen.restore();
  pen.strokeStyle = colourOf("line");
  pen.lineWidth = 1;
  pen.strokeRect(...whole);
}

/* The mark under the pointer, if there is one. */
function markAt(spots, x, y) {
  let best = null;
  let least = MARK_REACH;
  for (const spot of spots) {
    const distance = Math.hypot(spot.x - x, spot.y - y);
    if (distance < least) [best, least] = [spot, distance];
  }
  return best;
}
