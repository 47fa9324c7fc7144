/* The explorer: controls that choose a row, its range profile and its range-rate map. */
const speedWords = (speed) => `${speed < 0 ? "receding" : "closing"} ${fixed(Math.abs(speed), 2)} m/s `
  + `(${fixed(3.6 * Math.abs(speed), 0)} km/h)`;

const element = (tag, properties, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

/* A plot that says what is under the pointer, and goes from detection to detection by arrow keys.
   `draw` draws it and gives its axes and spots, `rangeOf` is the range at which it has a place, and
   `words` describes a place without a detection. */
class LivePlot {
  constructor(figure, { draw, rangeOf, words, moved, causes }) {
    Object.assign(this, { draw, rangeOf, words, moved, causes, at: null });
    [this.canvas, this.tip] = [figure.querySelector("canvas"), figure.querySelector(".tip")];
    for (const name of ["pointermove", "pointerdown"]) {
      this.canvas.addEventListener(name, (event) => this.point(event));
    }
    for (const name of ["pointerleave", "blur"]) this.canvas.addEventListener(name, () => this.leave());
    this.canvas.addEventListener("keydown", (event) => this.step(event));
  }

  redraw(cursor) { this.view = this.draw(this.canvas, cursor); }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const { axes, spots } = this.view;
    if (x < axes.left || x > axes.right || y < axes.top || y > axes.bottom) return this.leave();
    const distance = (spot) => Math.hypot(spot.x - x, spot.y - y);
    const [near] = spots.filter((spot) => distance(spot) < MARK_REACH).sort((a, b) => distance(a) - distance(b));
    return this.show(near ? near.mark : { range: axes.xAt(x), speed: axes.yAt(y) });
  }

  step(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    const marks = this.view.spots.map((spot) => spot.mark).sort((a, b) => this.rangeOf(a) - this.rangeOf(b));
    if (!way || !marks.length) return;
    event.preventDefault();
    const next = this.at ? marks.indexOf(this.at) + way : 0;
    this.show(marks.at(next % marks.length));
  }

  /* Shows the words about a detection, or about any other place. */
  show(place) {
    this.at = place.cause ? place : null;
    this.moved(place);
    const { label } = this.causes[place.cause] ?? {};
    const words = label ? [place.origin ? `${label}: ${place.origin}` : label, `${fixed(this.rangeOf(place), 2)} m`,
      speedWords(place.speed), `${fixed(place.power)} dBm`] : this.words(place);
    this.tip.replaceChildren(...words.map((textContent) => element("span", { textContent })));
    this.tip.hidden = false;
    const x = this.view.axes.px(this.rangeOf(place));
    const isRight = x + 14 + this.tip.offsetWidth > this.view.axes.right;
    this.tip.style.left = `${Math.max(0, isRight ? x - 14 - this.tip.offsetWidth : x + 14)}px`;
  }

  leave() {
    this.at = null;
    this.tip.hidden = true;
    this.moved(null);
  }
}

/* Profile and map of one frame, with a common cursor and a legend. */
class FramePlots {
  constructor(section, causes) {
    Object.assign(this, { causes, list: section.querySelector(".legend") });
    const [profile, map] = section.querySelectorAll(".plot");
    const moved = (cursor) => this.draw(cursor);
    const range = (place) => `${fixed(place.range, 2)} m`;
    this.plots = [
      new LivePlot(profile, {
        causes, moved, rangeOf: inProfile,
        draw: (canvas, cursor) => drawProfile(canvas, this.row, { ...this, cursor }),
        words: (place) => [range(place), `${fixed(powerAt(this.row, place.range))} dBm`],
      }),
      new LivePlot(map, {
        causes, moved, rangeOf: (place) => place.range,
        draw: (canvas, cursor) => drawMap(canvas, this.row, { causes, cursor }),
        words: (place) => [range(place), speedWords(place.speed),
          `${fixed(levelAt(this.row.map, place.range, place.speed), 0)} dBm`],
      }),
    ];
    window.addEventListener("look", () => this.show(this.row, this.behind, this.limits));
  }

  show(row, behind, limits) {
    Object.assign(this, { row, behind, limits });
    this.draw(null);
    this.legend();
  }

  draw(cursor) { this.plots.forEach((plot) => plot.redraw(cursor)); }

  legend() {
    const curves = [["accent", "range profile"], ...(this.behind ? [["faint", "equal slopes"]] : [])];
    const items = curves.map(([name, label]) => element("li", {}, element("i", { className: `curve ${name}` }), label));
    const signs = [];
    for (const [name, cause] of Object.entries(this.causes)) {
      const count = this.row.marks.filter((mark) => mark.cause === name).length;
      if (!count) continue;
      const sign = element("canvas", { className: "sign", ariaHidden: "true" });
      items.push(element("li", {}, sign, `${cause.label} (${count})`));
      signs.push([sign, cause]);
    }
    this.list.replaceChildren(...items);
    signs.forEach(([sign, cause]) => drawMark(prepared(sign).pen, cause, 9, 9));
  }
}

/* What a row shows, in words. */
function rowWords(row) {
  const found = row.targets.filter((target) => target.found).map((target) => target.name);
  const [ghost] = row.marks.filter((mark) => ["direct", "indirect"].includes(mark.cause))
    .sort((a, b) => b.power - a.power);
  return `Found: ${found.join(", ") || "no target"}. `
    + (ghost ? `Strongest ghost of interference: ${fixed(inProfile(ghost), 2)} m, ${fixed(ghost.power, 0)} dBm. `
      : "No ghost of interference. ")
    + `Floor rise: ${fixed(row.floor_rise)} dB.`;
}

/* Connects the radio buttons with the plots: their values, in order, are the key of a row. */
function startExplorer({ rows, causes }) {
  const section = document.getElementById("explorer");
  const form = section.querySelector("form");
  const plots = new FramePlots(section, causes);
  const chosen = (changes = {}) => {
    const { behind, ...fields } = { ...Object.fromEntries(new FormData(form)), ...changes };
    return rows.find((row) => row.key === Object.values(fields).join("|"));
  };
  const update = () => {
    const victim = form.elements.case.value;
    const start = form.querySelector("#start"); /* a group that is disabled has no value */
    if (start) start.disabled = victim.startsWith("A|");
    const row = chosen();
    if (!row) return;
    const behind = form.elements.behind?.checked ? chosen({ waveform: "conventional" }) : null;
    const limits = powerLimits(rows.filter((one) => `${one.key}|`.startsWith(`${victim}|`)));
    plots.show(row, behind === row ? null : behind, limits);
    section.querySelector("output").textContent = rowWords(row);
  };
  form.addEventListener("change", update);
  for (const link of document.querySelectorAll("a[data-row]")) {
    link.addEventListener("click", () => {
      const [scenario, radar, waveform, mitigation, start = "together"] = link.dataset.row.split("|");
      const values = { case: `${scenario}|${radar}`, waveform, mitigation, start };
      for (const [name, value] of Object.entries(values)) form.elements[name].value = value;
      update();
    });
  }
  update();
}

function startHeadline({ rows, headline }) {
  const canvas = document.getElementById("headline");
  const [conventional, diverse] = ["conventional", "diverse"]
    .map((name) => rows.find((row) => row.key === headline?.[name]));
  if (!canvas || !conventional || !diverse) return;
  const draw = () => drawHeadline(canvas, conventional, diverse, headline.ghost);
  window.addEventListener("look", draw);
  draw();
}
