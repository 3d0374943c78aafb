// A result: its figures become plots to zoom into, its checks get their place between the limits.
import { read, part } from "./api.js";
import { bar, plotted } from "./charts.js";

for (const canvas of document.querySelectorAll("canvas.bar")) bar(canvas);
const report = document.getElementById("report");
if (report && document.querySelector("figure[data-figure]")) {
  try {
    const { sections } = await read(`/api/v1/results/${part(report.dataset.result)}/report`);
    const figures = sections.filter((section) => section.figure).map((section) => section.figure);
    for (const element of document.querySelectorAll("figure[data-figure]")) {
      const figure = figures[Number(element.dataset.figure) - 1], image = element.querySelector("img");
      if (figure && image) image.replaceWith(plotted(figure));
    }
  } catch (error) { console.warn(error.message); /* the images stay */ }
}
