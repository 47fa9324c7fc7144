/* The explorer: controls that choose a case, its range profile, and its range-rate map. */

/* Draws a plot anew when the page changes its look, and shows what is under the pointer. */
class LivePlot {
  constructor(figure, draw, describe, moved) {
    this.canvas = figure.querySelector("canvas");
    this.tip = figure.querySelector(".tip");
    Object.assign(this, { draw, describe, moved, view: null });
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerdown", (event) => this.point(event));
    this.canvas.addEventListener("pointerleave", () => this.leave());
    this.canvas.addEventListener("blur", () => this.leave());
    this.canvas.addEventListener("keydown", (event) => this.step(event));
  }

  redraw(cursor = null) {
    this.view = this.draw(this.canvas, cursor);
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const { axes, spots } = this.view;
    const isOutside = x < axes.left || x > axes.right || y < axes.top || y > axes.bottom;
    if (isOutside) return this.leave();
    const spot = markAt(spots, x, y);
    const cursor = spot
      ? { range: spot.mark.range, speed: spot.mark.speed }
      : { range: axes.xAt(x), speed: axes.yAt(y) };
    return this.show(cursor, spot ? spot.mark : null);
  }

  /* The arrow keys go from detection to detection. */
  step(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const marks = this.view.spots.map((spot) => spot.mark).sort((a, b) => a.range - b.range);
    if (!marks.length) return;
    const now = marks.indexOf(this.at);
    const next = marks[(now + way + marks.length) % marks.length];
    this.show({ range: next.range, speed: next.speed }, next);
  }

  show(cursor, mark) {
    this.at = mark;
    this.moved(cursor);
    this.tip.replaceChildren(
      ...this.describe(cursor, mark).map((words) => {
        const line = document.createElement("span");
        line.textContent = words;
        return line;
      }),
    );
    this.tip.hidden = false;
    const { axes } = this.view;
    const x = axes.px(cursor.range);
    const wide = this.tip.offsetWidth;
    const isRight = x + 14 + wide > axes.right;
    this.tip.style.left = `${Math.max(0, isRight ? x - 14 - wide : x + 14)}px`;
    this.tip.style.top = `${axes.top + 24}px`;
  }

  leave() {
    this.at = null;
    this.tip.hidden = true;
    this.moved(null);
  }
}

const speedWords = (speed) =>
  `${speed < 0 ? "receding" : "closing"} ${fixed(Math.abs(speed), 2)} m/s ` +
  `(${fixed(3.6 * Math.abs(speed), 0)} km/h)`;

function markWords(mark, causes) {
  const who = mark.body ? `${causes[mark.cause].label}: ${mark.body}` : causes[mark.cause].label;
  return [who, `${fixed(mark.range, 2)} m`, speedWords(mark.speed), `${fixed(mark.power)} dBm`];
}

/* The causes that the detections of a row have, with the colours of the curves. */
function legend(list, row, causes, behind) {
  const entries = [["curve accent", "range profile"]];
  if (behind) entries.push(["curve faint", "the same with equal slopes"]);
  const items = entries.map(([kind, label]) => {
    const item = document.createElement("li");
    item.append(Object.assign(document.createElement("i"), { className: kind }), label);
    return item;
  });
  for (const name of Object.keys(causes)) {
    const count = row.marks.filter((mark) => mark.cause === name).length;
    if (!count) continue;
    const item = document.createElement("li");
    const sign = document.createElement("canvas");
    Object.assign(sign, { className: "sign" });
    sign.setAttribute("aria-hidden", "true");
    item.append(sign, `${causes[name].label} (${count})`);
    items.push(item);
    item.draw = () => drawMark(prepared(sign).pen, causes[name], 9, 9);
  }
  list.replaceChildren(...items);
  items.forEach((item) => item.draw?.());
}

/* One frame of one radar: profile above, map below, with a common cursor and a legend. */
class FramePlots {
  constructor(section, causes) {
    this.causes = causes;
    this.list = section.querySelector(".legend");
    const [profile, map] = section.querySelectorAll(".plot");
    const moved = (cursor) => this.draw(cursor);
    this.profile = new LivePlot(
      profile,
      (canvas, cursor) => drawProfile(canvas, this.row, { ...this.context(), cursor }),
      (cursor, mark) => (mark
        ? markWords(mark, causes)
        : [`${fixed(cursor.range, 2)} m`, `${fixed(powerAt(this.row, cursor.range))} dBm`]),
      moved,
    );
    this.map = new LivePlot(
      map,
      (canvas, cursor) => drawMap(canvas, this.row, { causes, cursor }),
      (cursor, mark) => (mark
        ? markWords(mark, causes)
        : [`${fixed(cursor.range, 2)} m`, speedWords(cursor.speed),
          `${fixed(levelAt(this.row.map, cursor.range, cursor.speed), 0)} dBm`]),
      moved,
    );
    window.addEventListener("look", () => this.row && this.show(this.row, this.behind, this.limits));
  }

  context() {
    return { causes: this.causes, behind: this.behind, limits: this.limits };
  }

  show(row, behind, limits) {
    Object.assign(this, { row, behind, limits });
    this.draw(null);
    legend(this.list, row, this.causes, behind);
  }

  draw(cursor) {
    this.profile.redraw(cursor);
    this.map.redraw(cursor);
  }
}

/* The controls of the page of the paper, each a group of radio buttons. */
function startExplorer(data) {
  const section = document.getElementById("explorer");
  const form = section.querySelector("form");
  const plots = new FramePlots(section, data.causes);
  const rows = new Map(data.rows.map((row) => [row.key, row]));
  const says = section.querySelector("output");

  const chosen = (changes = {}) => {
    const fields = { ...Object.fromEntries(new FormData(form)), ...changes };
    if (fields.case.startsWith("A|")) fields.start = "together";
    return rows.get([fields.case, fields.waveform, fields.mitigation, fields.start].join("|"));
  };

  function update() {
    const fields = new FormData(form);
    form.querySelector("#start").disabled = fields.get("case").startsWith("A|");
    const row = chosen();
    if (!row) return;
    const behind = fields.get("behind") ? chosen({ waveform: "conventional" }) : null;
    const victim = `${fields.get("case")}|`;
    const limits = powerLimits(data.rows.filter((one) => one.key.startsWith(victim)));
    plots.show(row, behind === row ? null : behind, limits);
    says.textContent = rowWords(row);
  }

  form.addEventListener("change", update);
  for (const link of document.querySelectorAll("a[data-row]")) {
    link.addEventListener("click", () => {
      const [scenario, radar, waveform, mitigation, start] = link.dataset.row.split("|");
      const values = { case: `${scenario}|${radar}`, waveform, mitigation, start };
      for (const [name, value] of Object.entries(values)) form.elements[name].value = value;
      update();
    });
  }
  update();
}

function rowWords(row) {
  const found = row.targets.filter((target) => target.found).map((target) => target.name);
  const ghosts = row.marks.filter((mark) => ["direct", "indirect"].includes(mark.cause));
  const strongest = ghosts.length && ghosts.reduce((a, b) => (a.power > b.power ? a : b));
  return [
    `Found: ${found.join(", ") || "no target"}.`,
    strongest
      ? `Strongest ghost of interference: ${fixed(strongest.range, 2)} m, ${fixed(strongest.power, 0)} dBm.`
      : "No ghost of interference.",
    `Floor rise: ${fixed(row.floor_rise)} dB.`,
  ].join(" ");
}

/* The picture at the top: both waveforms, the ghost, and the rise of the floor. */
function startHeadline(data) {
  const canvas = document.getElementById("headline");
  if (!canvas || !data.headline) return;
  const find = (key) => data.rows.find((row) => row.key === key);
  const [conventional, diverse] = [find(data.headline.conventional), find(data.headline.diverse)];
  if (!conventional || !diverse) return;
  const draw = () => drawHeadline(canvas, conventional, diverse, data.headline.ghost);
  window.addEventListener("look", draw);
  draw();
}

function drawHeadline(canvas, conventional, diverse, ghost) {
  const axes = new PlotAxes(canvas, [0, 30], powerLimits([conventional, diverse]));
  const isWide = axes.right - axes.left > 500;
  axes.grid("Range (m)", "Power (dBm)");
  axes.clipped(() => {
    drawLevel(axes, diverse.noise, "thermal noise");
    drawTargets(axes, diverse);
    drawCurve(axes, conventional, colourOf("bad"), 1.8);
    drawCurve(axes, diverse, colourOf("accent"), 2.2);
    axes.pen.font = "600 13px system-ui, sans-serif";
    if (ghost) {
      const top = powerAt(conventional, ghost.range);
      axes.text(`ghost at ${fixed(ghost.range, 2)} m`, ghost.range, top, {
        align: "right", colour: "bad", dx: -12, dy: 4,
      });
    }
    drawRise(axes, diverse, 23);
    const at = isWide ? 18 : 17;
    axes.text("equal slopes", at, powerAt(conventional, at), { colour: "bad", dx: -10, dy: 26, align: "right" });
    axes.text("diverse slopes", at, powerAt(diverse, at), { colour: "accent", dy: -14 });
  });
}

/* An arrow from thermal noise to the profile of a row. */
function drawRise(axes, row, range) {
  const top = powerAt(row, range);
  const { pen } = axes;
  pen.strokeStyle = colourOf("ink");
  pen.lineWidth = 1.5;
  axes.line([[range, row.noise], [range, top]]);
  for (const [level, way] of [[row.noise, -1], [top, 1]]) {
    pen.beginPath();
    pen.moveTo(axes.px(range) - 5, axes.py(level) + 7 * way);
    pen.lineTo(axes.px(range), axes.py(level));
    pen.lineTo(axes.px(range) + 5, axes.py(level) + 7 * way);
    pen.stroke();
  }
  axes.text(`+${fixed(top - row.noise, 0)} dB`, range, (row.noise + top) / 2, { dx: 9, dy: 4 });
}
