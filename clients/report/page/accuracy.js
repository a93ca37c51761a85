// The page of an accuracy report: one measure is plotted, one setting is shown; both can be chosen.

const report = JSON.parse(document.getElementById("data").textContent);
const byId = new Map(report.settings.map((setting) => [setting.id, setting]));
const chooser = document.getElementById("setting");
let measure = report.measures[0];
let chosen = (report.settings.find(({ marks }) => marks.includes("default")) ?? report.settings[0]).id;

function drawMeasure() {
  drawPlot(document.getElementById("plot"), measure, report.settings, chosen, choose);
  document.getElementById("sees").textContent = measure.sees;
}

function choose(id) {
  chosen = id;
  chooser.value = id;
  for (const line of document.querySelectorAll("#settings tbody tr")) line.classList.toggle("chosen", line.dataset.id === id);
  showSetting(document.getElementById("compare"), byId.get(id), report.reference, report.places);
  drawMeasure();
}

function offerMeasures() {
  const place = document.getElementById("measures");
  for (const offered of report.measures) {
    const label = document.createElement("label");
    const radio = Object.assign(document.createElement("input"), { type: "radio", name: "measure", value: offered.key });
    radio.checked = offered === measure;
    radio.addEventListener("change", () => {
      measure = offered;
      drawMeasure();
    });
    label.append(radio, offered.name);
    place.append(label);
  }
}

for (const { id, label } of report.settings) chooser.append(new Option(label, id));
chooser.addEventListener("change", () => choose(chooser.value));
for (const line of document.querySelectorAll("#settings tbody tr")) {
  line.querySelector("button").addEventListener("click", () => {
    choose(line.dataset.id);
    chooser.scrollIntoView({ block: "start" });
  });
}
makeSortable(document.getElementById("settings"));
offerMeasures();
choose(chosen);
new ResizeObserver(drawMeasure).observe(document.querySelector("main"));
