// A surface drawn by WebGL 2 and turned by hand. `body`: points (Float32Array, m from its middle), triangles
// (Uint32Array), shapes (arrays of displacements, one a shape), colours (256 x [r, g, b]), radius, axes (right, up, to
// the eye). It stands alone in a script or a module.
class SurfaceView {
  static VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in float value;
uniform mat3 axes; uniform vec2 window; uniform vec2 range; uniform sampler2D colours;
out vec3 colour; out vec3 facing;
void main() {
  vec3 seen = axes * place;
  gl_Position = vec4(seen.xy * window, -0.2 * seen.z * window.y, 1.0);
  float share = clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
  colour = texture(colours, vec2((share * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  facing = axes * normal;
}`;
  static FRAGMENT = `#version 300 es
precision mediump float;
in vec3 colour; in vec3 facing; out vec4 shade;
void main() {
  vec3 n = normalize(facing);
  float light = 0.45 + 0.45 * max(0.0, dot(n, normalize(vec3(-0.3, 0.5, 0.8)))) + 0.15 * max(0.0, n.z);
  shade = vec4(colour * light, 1.0);
}`;

  constructor(canvas, body) {
    this.canvas = canvas; this.body = body;
    this.zoom = 1; this.turnX = this.turnY = 0; this.changed = () => {};
    this.range = [0, 1];
    this.moved = new Float32Array(body.points.length); this.normals = new Float32Array(body.points.length);
    this.gl = canvas.getContext("webgl2", {antialias: true});
    if (this.gl) { this.prepare(); this.listen(); }
  }

  part(kind, text) {
    const gl = this.gl, made = gl.createShader(kind);
    gl.shaderSource(made, text); gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  }

  prepare() {
    const gl = this.gl, program = gl.createProgram();
    gl.attachShader(program, this.part(gl.VERTEX_SHADER, SurfaceView.VERTEX));
    gl.attachShader(program, this.part(gl.FRAGMENT_SHADER, SurfaceView.FRAGMENT));
    gl.linkProgram(program); gl.useProgram(program);
    this.place = name => gl.getUniformLocation(program, name);
    this.buffers = {};
    for (const [name, width] of [["place", 3], ["normal", 3], ["value", 1]]) {
      this.buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      const at = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(at); gl.vertexAttribPointer(at, width, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.body.triangles, gl.STATIC_DRAW);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    this.colour(this.body.colours);
    gl.enable(gl.DEPTH_TEST); gl.clearColor(1, 1, 1, 1);
  }

  colour(scale) {
    const gl = this.gl;
    if (gl) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(scale.flat()));
  }

  // Move the points: `weight` of each shape, then a turn about the crank's axis; `values` are what colours show.
  move(weight, turn, values) {
    const {points, shapes, triangles} = this.body, n = points.length, {moved, normals} = this;
    const cos = Math.cos(turn), sin = Math.sin(turn);
    moved.set(points);
    shapes.forEach((shape, m) => { const w = weight[m]; for (let i = 0; i < n; i++) moved[i] += w * shape[i]; });
    for (let i = 0; i < n; i += 3) {
      const x = moved[i], y = moved[i + 1];
      moved[i] = cos * x - sin * y; moved[i + 1] = sin * x + cos * y;
    }
    normals.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
      const ux = moved[b] - moved[a], uy = moved[b + 1] - moved[a + 1], uz = moved[b + 2] - moved[a + 2];
      const vx = moved[c] - moved[a], vy = moved[c + 1] - moved[a + 1], vz = moved[c + 2] - moved[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const p of [a, b, c]) { normals[p] += x; normals[p + 1] += y; normals[p + 2] += z; }
    }
    this.values = values;
    const gl = this.gl;
    if (gl) for (const [name, array] of [["place", moved], ["normal", normals], ["value", values]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.DYNAMIC_DRAW);
    }
  }

  // Columns of a mat3: the picture's axes, turned by hand about the picture's right and the page's up.
  eye() {
    const [r, u, e] = this.body.axes;
    const [ca, sa, cb, sb] = [Math.cos(this.turnY), Math.sin(this.turnY), Math.cos(this.turnX), Math.sin(this.turnX)];
    const mix = (a, b, p, q) => a.map((v, i) => p * v + q * b[i]);
    const right = mix(r, e, ca, -sa), near = mix(r, e, sa, ca);
    const up = mix(u, near, cb, -sb), to = mix(u, near, sb, cb);
    return [0, 1, 2].flatMap(i => [right[i], up[i], to[i]]);
  }

  draw() {
    const box = this.canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1, {canvas, gl} = this;
    const width = Math.round(box.width * ratio), height = Math.round(box.height * ratio);
    if (!gl || !width || !height || !this.values) return;
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const unit = this.zoom / this.body.radius * Math.min(1.6, 0.95 * width / height);
    this.window = [unit * height / width, unit];
    gl.uniform2f(this.place("window"), ...this.window);
    gl.uniform2f(this.place("range"), ...this.range);
    gl.uniformMatrix3fv(this.place("axes"), false, this.eye());
    gl.drawElements(gl.TRIANGLES, this.body.triangles.length, gl.UNSIGNED_INT, 0);
  }

  // Number of the foremost point within a few pixels of a place in the canvas, or -1.
  pick(x, y, near = 6) {
    const box = this.canvas.getBoundingClientRect(), eye = this.eye(), {moved, window: w} = this;
    let best = -1, front = -Infinity;
    for (let i = 0; w && i < moved.length; i += 3) {
      const [a, b, c] = [moved[i], moved[i + 1], moved[i + 2]];
      const px = 0.5 * box.width * (1 + w[0] * (eye[0] * a + eye[3] * b + eye[6] * c));
      const py = 0.5 * box.height * (1 - w[1] * (eye[1] * a + eye[4] * b + eye[7] * c));
      if (Math.abs(px - x) > near || Math.abs(py - y) > near) continue;
      const depth = eye[2] * a + eye[5] * b + eye[8] * c;
      if (depth > front) { front = depth; best = i / 3; }
    }
    return best;
  }

  listen() {
    const {canvas} = this, fingers = new Map();
    let apart = 0;
    const redraw = () => { this.draw(); this.changed(); };
    canvas.onpointerdown = e => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); apart = 0; };
    canvas.onpointerup = canvas.onpointercancel = e => { fingers.delete(e.pointerId); apart = 0; };
    canvas.onpointermove = e => {
      const before = fingers.get(e.pointerId);
      if (!before) return;
      fingers.set(e.pointerId, e);
      if (fingers.size === 2) {
        const [a, b] = [...fingers.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (apart) this.zoom *= now / apart;
        apart = now;
      } else {
        this.turnY += 0.008 * (e.clientX - before.clientX); this.turnX += 0.008 * (e.clientY - before.clientY);
      }
      redraw();
    };
    canvas.onwheel = e => { e.preventDefault(); this.zoom *= Math.exp(-0.001 * e.deltaY); redraw(); };
    canvas.ondblclick = () => { this.zoom = 1; this.turnX = this.turnY = 0; redraw(); };
  }
}
