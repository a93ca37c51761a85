// One setting beside the reference: whole frames, the error, and enlarged parts.

/** Fill `place` with a setting's pictures beside those of the reference. */
function showSetting(place, setting, reference, places) {
  const rows = [
    row("whole", [
      picture(reference.pictures.frame, "reference", reference.file),
      picture(setting.pictures.frame, setting.label, setting.files.frame),
      picture(setting.pictures.error, "error: black below 0.001 of white, brightest at 1", setting.files.error),
    ]),
    row("parts", Object.entries(places).flatMap(([name, text]) => [
      picture(reference.pictures[name], `reference, ${text}`),
      picture(setting.pictures[name], `this setting, ${text}`),
    ])),
  ];
  const facts = document.createElement("dl");
  for (const [name, value] of setting.facts) facts.append(textElement("dt", name), textElement("dd", value));
  if (setting.jod !== null) facts.append(textElement("dt", "preference"), textElement("dd", setting.jod));
  place.replaceChildren(facts, ...rows);
}

function row(kind, pictures) {
  const made = document.createElement("div");
  made.className = `pictures ${kind}`;
  made.append(...pictures);
  return made;
}

function picture(address, caption, file) {
  const figure = document.createElement("figure");
  const image = new Image();
  image.src = address;
  image.alt = caption;
  const words = document.createElement("figcaption");
  words.textContent = caption;
  if (file) words.append(" ", link(file, "full size"));
  figure.append(image, words);
  return figure;
}

function link(file, text) {
  const made = document.createElement("a");
  made.href = file;
  made.textContent = text;
  return made;
}

function textElement(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}
