// The three-axis table in perspective: base, outer, middle and inner frame, and the unit with its axes.
// Axes as in the service: north, up, east; rot_rb = R_y(outer) R_z(middle) R_x(inner).
const rad = Math.PI / 180;
const mul = (a, b) => a.map((row) => b[0].map((_, j) => row.reduce((sum, x, k) => sum + x * b[k][j], 0)));
const apply = (m, v) => m.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
const about = {
  x: (a) => [[1, 0, 0], [0, Math.cos(a), -Math.sin(a)], [0, Math.sin(a), Math.cos(a)]],
  y: (a) => [[Math.cos(a), 0, Math.sin(a)], [0, 1, 0], [-Math.sin(a), 0, Math.cos(a)]],
  z: (a) => [[Math.cos(a), -Math.sin(a), 0], [Math.sin(a), Math.cos(a), 0], [0, 0, 1]],
};
const ring = (radius, plane) => [...Array(49).keys()].map((k) => {
  const c = radius * Math.cos(k * Math.PI / 24), s = radius * Math.sin(k * Math.PI / 24);
  return { xy: [c, s, 0], yz: [0, c, s], xz: [c, 0, s] }[plane];
});
const VIEW = mul(about.x(24 * rad), about.y(-35 * rad));

function project([x, y, z], size) {
  const [vx, vy, vz] = apply(VIEW, [x, y, z]), depth = 1 / (1 + vz * 0.12);
  return [size.w / 2 + vx * size.s * depth, size.h / 2 - vy * size.s * depth];
}

function line(context, points, turn, size, colour, width, dash = []) {
  context.beginPath();
  points.forEach((point, k) => context[k ? "lineTo" : "moveTo"](...project(turn ? apply(turn, point) : point, size)));
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.stroke();
}

function frames([outer, middle, inner]) {
  const o = about.y(outer * rad), m = mul(o, about.z(middle * rad));
  return { o, m, i: mul(m, about.x(inner * rad)) };
}

function unit(context, turn, size, ink, dash = []) {
  const [a, b, c] = [0.34, 0.2, 0.26];
  const corner = (k) => [k & 1 ? a : -a, k & 2 ? b : -b, k & 4 ? c : -c];
  for (const [from, to] of [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]]) {
    line(context, [corner(from), corner(to)], turn, size, ink, 1.4, dash);
  }
}

/** Draws the table at its measured angles [deg: outer, middle, inner]; the commanded ones are dashed where they differ. */
export function attitude(canvas, measured, commanded = null) {
  const context = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
  const ink = style.getPropertyValue("--ink").trim() || "#222", faint = style.getPropertyValue("--faint").trim() || "#999";
  const size = { w: canvas.width, h: canvas.height, s: Math.min(canvas.width, canvas.height) * 0.36 };
  const { o, m, i } = frames(measured);
  context.clearRect(0, 0, size.w, size.h);
  line(context, ring(1.25, "xz").map(([x, , z]) => [x, -1.15, z]), null, size, faint, 1);
  line(context, [[0, -1.15, 0], [0, -1.02, 0]], null, size, faint, 3);
  line(context, [[1.25, -1.15, 0], [1.45, -1.15, 0]], null, size, faint, 2);
  line(context, ring(1.02, "xy"), o, size, "#7c3aed", 2.2);
  line(context, ring(0.84, "xz"), m, size, "#0e7490", 2.2);
  unit(context, i, size, ink);
  for (const [axis, colour, name] of [[[0.72, 0, 0], "#dc2626", "x"], [[0, 0.72, 0], "#16a34a", "y"], [[0, 0, 0.72], "#2563eb", "z"]]) {
    line(context, [[0, 0, 0], axis], i, size, colour, 2.4);
    context.fillStyle = colour;
    context.font = "12px system-ui, sans-serif";
    context.fillText(name, ...project(apply(i, axis.map((v) => v * 1.12)), size));
  }
  if (commanded && commanded.some((angle, k) => Math.abs(angle - measured[k]) > 0.05)) unit(context, frames(commanded).i, size, "#d97706", [4, 3]);
  canvas.dataset.drawn = measured.map((angle) => angle.toFixed(2)).join(" ");
}
