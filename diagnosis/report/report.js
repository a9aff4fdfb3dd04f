"use strict";
// The page needs no script to be read. This one tells the values under the pointer, and opens what is folded for print.
const SHOWN = 4; // significant digits

function points(path) {
  // "M x yL x y..." or dots "M x yh0": pairs of numbers in units of the drawing.
  path.points ??= path.getAttribute("d").replaceAll("h0", "").split(/[MLZ]/).filter(Boolean).map((p) => p.split(" ").map(Number));
  return path.points;
}

function tell(frame, event) {
  const svg = frame.querySelector("svg");
  const box = svg.getBoundingClientRect();
  const [units] = svg.getAttribute("viewBox").split(" ").slice(2).map(Number);
  const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
  const [x0, x1] = svg.dataset.x.split(" ").map(Number);
  const [y0, y1] = svg.dataset.y.split(" ").map(Number);
  const lines = [`${svg.dataset.of}: ${Number((x0 + share * (x1 - x0)).toPrecision(SHOWN))}`];
  for (const path of svg.querySelectorAll("path[data-label]:not(.band)")) {
    const at = share * units;
    let nearest = null;
    for (const p of points(path)) { if (!nearest || Math.abs(p[0] - at) < Math.abs(nearest[0] - at)) { nearest = p; } }
    if (nearest && Math.abs(nearest[0] - at) < units / 100) {
      lines.push(`${path.dataset.label}: ${Number((y1 - (nearest[1] / units) * (y1 - y0)).toPrecision(SHOWN))}`);
    }
  }
  hide(frame);
  const cursor = frame.appendChild(Object.assign(document.createElement("div"), { className: "cursor" }));
  cursor.style.left = `${100 * share}%`;
  const tip = frame.appendChild(Object.assign(document.createElement("div"), { className: "tip" }));
  tip.append(...lines.flatMap((line, i) => (i ? [document.createElement("br"), line] : [line])));
  tip.style[share < 0.5 ? "left" : "right"] = `calc(${100 * (share < 0.5 ? share : 1 - share)}% + 8px)`;
}

function hide(frame) {
  frame.querySelectorAll(".cursor, .tip").forEach((one) => one.remove());
}

for (const svg of document.querySelectorAll("svg[data-hover]")) {
  const frame = svg.parentElement;
  frame.addEventListener("pointermove", (event) => tell(frame, event));
  frame.addEventListener("pointerleave", () => hide(frame));
}
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((one) => { one.open = true; }));
