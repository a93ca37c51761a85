// Time against one measure of accuracy, both on log axes, drawn as SVG.

const SVG = "http://www.w3.org/2000/svg";
const MARGIN = { left: 54, right: 16, top: 30, bottom: 46 };
const ROOM = 1.25; // factor between the outermost points and the frame
const LEAST_SHARE = 0.3; // a loss of 0 is drawn at this share of the smallest other one

/**
 * Draw all settings that have the measure.
 *
 * @param figure   the element to fill
 * @param measure  { key, axis, front }
 * @param settings all settings
 * @param chosen   id of the one that is shown below
 * @param choose   called with the id of a point that is clicked
 */
function drawPlot(figure, measure, settings, chosen, choose) {
  const known = settings.filter((setting) => setting.losses[measure.key] !== null);
  const positive = known.map((setting) => setting.losses[measure.key]).filter((loss) => loss > 0);
  const floor = LEAST_SHARE * (positive.length ? Math.min(...positive) : 1);
  const points = known.map((setting) => ({
    setting, time: setting.time.median, loss: Math.max(floor, setting.losses[measure.key]),
  }));
  const width = Math.max(300, figure.clientWidth);
  const height = Math.max(280, Math.min(460, width * 0.6));
  const x = logScale(points.map(({ time }) => time), MARGIN.left, width - MARGIN.right);
  const y = logScale(points.map(({ loss }) => loss), height - MARGIN.bottom, MARGIN.top);
  const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `time against ${measure.axis}` });
  drawAxes(svg, x, y, width, height, measure.axis);
  drawFront(svg, measure.front.map((id) => points.find(({ setting }) => setting.id === id)), x, y);
  const rank = ({ setting }) => setting.marks.length * 2 + measure.front.includes(setting.id);
  for (const point of points.toSorted((a, b) => rank(a) - rank(b))) {
    svg.append(drawPoint(point, x(point.time), y(point.loss), measure, chosen, choose));
  }
  drawLabels(svg, points, x, y, width);
  figure.replaceChildren(svg);
}

function element(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [attribute, value] of Object.entries(attributes)) made.setAttribute(attribute, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** A function from values to places; its `low` and `high` are where the axis ends. */
function logScale(values, start, end) {
  const low = Math.min(...values) / ROOM;
  const high = Math.max(...values) * ROOM;
  const place = (value) => start + ((end - start) * Math.log(value / low)) / Math.log(high / low);
  return Object.assign(place, { low, high });
}

function drawAxes(svg, x, y, width, height, axis) {
  const bottom = height - MARGIN.bottom;
  for (const time of logTicks(x.low, x.high)) {
    svg.append(element("line", { class: "grid", x1: x(time), x2: x(time), y1: MARGIN.top, y2: bottom }));
    svg.append(element("text", { x: x(time), y: bottom + 17, "text-anchor": "middle" }, timeText(time)));
  }
  for (const loss of logTicks(y.low, y.high)) {
    svg.append(element("line", { class: "grid", x1: MARGIN.left, x2: width - MARGIN.right, y1: y(loss), y2: y(loss) }));
    svg.append(element("text", { x: MARGIN.left - 7, y: y(loss) + 4, "text-anchor": "end" }, lossText(loss)));
  }
  const middle = (MARGIN.left + width - MARGIN.right) / 2;
  svg.append(element("text", { class: "axis", x: middle, y: height - 6, "text-anchor": "middle" }, "time of a frame"));
  svg.append(element("text", { class: "axis", x: 2, y: 14 }, axis));
}

/** The best that can be had in a given time: a staircase. */
function drawFront(svg, front, x, y) {
  const steps = front.map(({ time, loss }, index) =>
    index ? `H${x(time)}V${y(loss)}` : `M${x(time)},${y(loss)}`);
  svg.append(element("path", { class: "front", d: steps.join("") }));
}

function drawPoint({ setting, time, loss }, left, top, measure, chosen, choose) {
  const best = measure.front.includes(setting.id);
  const kind = [best ? "front" : "dominated", ...setting.marks, setting.id === chosen ? "chosen" : ""].join(" ");
  const point = element("g", { class: `point ${kind}`, "data-id": setting.id, tabindex: 0, role: "button" });
  const value = setting.losses[measure.key];
  point.append(element("title", {}, `${setting.label}: ${timeText(time)}, ${measure.axis} ${lossText(value)}`));
  point.append(element("circle", { class: "target", cx: left, cy: top, r: 13 }));
  point.append(setting.marks.length
    ? element("rect", { x: left - 6, y: top - 6, width: 12, height: 12, transform: setting.marks.includes("default") ? `rotate(45 ${left} ${top})` : "" })
    : element("circle", { cx: left, cy: top, r: best ? 5.5 : 4.5 }));
  point.addEventListener("click", () => choose(setting.id));
  point.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      choose(setting.id);
    }
  });
  return point;
}

/** Names beside the marked points. */
function drawLabels(svg, points, x, y, width) {
  for (const { setting, time, loss } of points) {
    if (!setting.marks.length) continue;
    const name = setting.marks.map((mark) => (mark === "paper" ? "the paper's setting" : mark)).join(", ");
    const right = x(time) > width * 0.7;
    const drop = setting.marks.includes("default") ? -9 : 20; // so that neighbours do not overlap
    const place = { x: x(time) + (right ? -13 : 13), y: y(loss) + drop, "text-anchor": right ? "end" : "start" };
    svg.append(element("text", { class: `name ${setting.marks[0]}`, ...place }, name));
  }
}
