// The crankshaft on the page of explore: the surface of surface.js with a colour scale and the value under the pointer.
const STYLE = `
.crank { position: relative; width: 100%; height: 100%; display: flex; flex-direction: column;
  font: 12px Helvetica, Arial, sans-serif; color: #444; padding: 8px 0 0 10px; box-sizing: border-box; }
.crank .title { font-weight: bold; font-size: 13px; }
.crank .space { flex: 1; position: relative; min-height: 180px; }
.crank canvas.surface { position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none; cursor: grab; }
.crank .scale { display: flex; gap: 6px; align-items: center; flex-wrap: wrap; }
.crank .bar { flex: 1 1 140px; max-width: 420px; }
.crank .bar canvas { width: 100%; height: 10px; display: block; }
.crank .ticks { display: flex; justify-content: space-between; }
.crank .here { position: absolute; background: #fffd; border: 1px solid #999; padding: 1px 4px; pointer-events: none;
  display: none; white-space: nowrap; }`;

export function render({model}) {
  const make = (name, parent, kind = "div") => {
    const made = document.createElement(kind);
    made.className = name; parent.append(made);
    return made;
  };
  const root = document.createElement("div");
  root.className = "crank";
  make("", root, "style").textContent = STYLE;
  const title = make("title", root), space = make("space", root), canvas = make("surface", space, "canvas");
  const here = make("here", space), said = make("caption", root), scale = make("scale", root);
  const quantity = make("", scale, "span"), bar = make("bar", scale), strip = make("", bar, "canvas");
  const ticks = make("ticks", bar);
  make("", root).textContent = "drag to turn, wheel to zoom, double click to set back, point at a place for its value";
  canvas.setAttribute("role", "img");

  const size = model.points.length, all = model.shapes;
  const shapes = Array.from({length: all.length / size}, (_, k) => all.subarray(k * size, (k + 1) * size));
  const view = new SurfaceView(canvas, {points: model.points, triangles: model.triangles, shapes,
    colours: model.colours, radius: model.radius, axes: model.axes});
  if (!view.gl) { space.textContent = "This browser draws no WebGL 2."; }

  let pointer = null, waiting = false;
  const point = () => {
    const k = pointer ? view.pick(...pointer) : -1;
    here.style.display = k < 0 ? "none" : "block";
    if (k < 0) return;
    here.textContent = `${view.values[k].toFixed(1)} MPa`;
    here.style.left = `${pointer[0] + 12}px`; here.style.top = `${pointer[1] + 8}px`;
  };
  const legend = () => {
    strip.width = 256; strip.height = 1;
    const context = strip.getContext("2d"), line = context.createImageData(256, 1);
    model.colours.forEach((c, i) => line.data.set([...c, 255], 4 * i));
    context.putImageData(line, 0, 0);
    ticks.replaceChildren();
    const [low, high] = [model.low, model.high];
    for (let k = 0; k < 5; k++) {
      const value = Number((low + k * (high - low) / 4).toPrecision(3));
      make("", ticks, "span").textContent = k === 4 ? `≥ ${value}` : k === 0 && low < 0 ? `≤ ${value}` : `${value}`;
    }
    quantity.textContent = model.quantity; title.textContent = model.title;
    canvas.setAttribute("aria-label", model.title);
    view.colour(model.colours); view.range = [low, high];
  };
  const show = () => {
    waiting = false;
    said.textContent = model.caption;
    view.move(model.weights, model.turn, model.values);
    view.draw(); point();
    root.dataset.frame = model.frame;
  };
  const soon = () => { if (!waiting) { waiting = true; requestAnimationFrame(show); } };
  canvas.addEventListener("pointermove", e => { pointer = [e.offsetX, e.offsetY]; point(); });
  canvas.addEventListener("pointerleave", () => { pointer = null; point(); });
  for (const name of ["colours", "low", "high", "quantity", "title"]) model.on(name, () => { legend(); soon(); });
  for (const name of ["weights", "turn", "values", "caption"]) model.on(name, soon);
  new ResizeObserver(() => { view.draw(); }).observe(space);
  legend(); show();
  return root;
}
