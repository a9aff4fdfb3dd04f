"use strict";
// Charts are read and chosen from without dragging on a phone, where a finger scrolls; on paper all is open and fits.
const PAPER_PX = 690;
const plots = [...document.querySelectorAll(".plotly-graph-div")];

function fit(layout) {
  plots.forEach((plot) => Plotly.relayout(plot, layout));
}

if (matchMedia("(pointer: coarse)").matches) { fit({ dragmode: false }); }
addEventListener("beforeprint", () => {
  document.querySelectorAll("details").forEach((one) => { one.open = true; });
  fit({ autosize: false, width: PAPER_PX });
});
addEventListener("afterprint", () => fit({ autosize: true, width: null }));
