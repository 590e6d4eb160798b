// The interactive view of a surface: WebGL 2, no library.
(function () {
  "use strict";
  const canvas = document.getElementById("view");
  if (!canvas) return;
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) {
    const note = document.createElement("p");
    note.textContent = "This browser draws no WebGL 2: the pictures below show the same surface.";
    canvas.replaceWith(note);
    document.querySelector(".controls").hidden = true;
    document.querySelector(".hint").hidden = true;
    return;
  }
  const numbers = (name) => canvas.dataset[name].split(" ").map(Number);
  const vertexCount = Number(canvas.dataset.vertices);
  const cornerCount = 3 * Number(canvas.dataset.triangles);
  const pointCount = Number(canvas.dataset.points);
  const size = numbers("size"), zUp = numbers("up")[2] > 0.5;
  const radius = Math.hypot(...size) / 2 || 1;
  const data = decode(document.getElementById("view-data").textContent);

  // See view_data.rs for the layout.
  function decode(text) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const positions = new Uint16Array(bytes.buffer, 0, 3 * vertexCount);
    const folded = new Int8Array(bytes.buffer, 6 * vertexCount, 2 * vertexCount);
    const normals = new Int8Array(4 * vertexCount);
    for (let v = 0; v < vertexCount; v++) {
      let x = folded[2 * v] / 127, y = folded[2 * v + 1] / 127;
      const z = 1 - Math.abs(x) - Math.abs(y), fold = Math.max(-z, 0);
      x -= x < 0 ? -fold : fold;
      y -= y < 0 ? -fold : fold;
      const scale = 127 / (Math.hypot(x, y, z) || 1);
      normals[4 * v] = Math.round(x * scale);
      normals[4 * v + 1] = Math.round(y * scale);
      normals[4 * v + 2] = Math.round(z * scale);
    }
    const points = new Uint16Array(bytes.buffer, 8 * vertexCount, 3 * pointCount);
    const corners = new Uint32Array(cornerCount);
    let at = 8 * vertexCount + 6 * pointCount, last = 0;
    for (let k = 0; k < cornerCount; k++) {
      let value = 0, scale = 1, byte;
      do {
        byte = bytes[at++];
        value += (byte & 127) * scale;
        scale *= 128;
      } while (byte > 127);
      last += value % 2 ? -(value + 1) / 2 : value / 2;
      corners[k] = last;
    }
    return { positions, normals, points, corners };
  }

  // A little perspective; magnification and shifts are those of the picture.
  const PLACE = `#version 300 es
    precision highp float;
    uniform mat3 turn; uniform vec3 size; uniform float radius; uniform vec2 zoom; uniform vec2 shift; uniform float nearer;
    layout(location = 0) in vec3 position;
    vec4 place() {
      vec3 e = turn * ((position - 0.5) * size) / radius;
      float w = 1.0 - 0.2 * e.z;
      return vec4(e.xy * zoom + shift * w, -0.5 * e.z - nearer * w, w);
    }`;
  const SURFACE = [PLACE + `
    layout(location = 1) in vec3 normal; out vec3 n;
    void main() { gl_Position = place(); n = turn * normal; }`,
    `#version 300 es
    precision highp float; in vec3 n; out vec4 colour;
    void main() {
      vec3 towards = normalize(n) * (gl_FrontFacing ? 1.0 : -1.0);
      float key = max(dot(towards, normalize(vec3(-0.35, 0.55, 0.75))), 0.0);
      float fill = max(dot(towards, normalize(vec3(0.7, -0.2, 0.5))), 0.0);
      float shine = pow(max(dot(towards, normalize(vec3(-0.2, 0.35, 1.0))), 0.0), 40.0);
      vec3 base = gl_FrontFacing ? vec3(0.56, 0.70, 0.88) : vec3(0.95, 0.62, 0.30);
      colour = vec4(base * (0.34 + 0.58 * key + 0.20 * fill) + 0.16 * shine, 1.0);
    }`];
  const POINTS = [PLACE + `
    uniform float pixels;
    void main() { gl_Position = place(); gl_PointSize = pixels; }`,
    `#version 300 es
    precision highp float; out vec4 colour;
    void main() {
      vec2 at = 2.0 * gl_PointCoord - 1.0;
      float r = dot(at, at);
      if (r > 1.0) discard;
      colour = vec4(vec3(0.74, 0.19, 0.16) * (1.0 - 0.4 * r), 1.0);
    }`];

  let gpu = null;
  function build() {
    const program = ([vertex, fragment]) => {
      const program = gl.createProgram();
      for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      }
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
      const at = {};
      for (const name of ["turn", "size", "radius", "zoom", "shift", "nearer", "pixels"]) at[name] = gl.getUniformLocation(program, name);
      return { program, at };
    };
    const fill = (target, content) => {
      gl.bindBuffer(target, gl.createBuffer());
      gl.bufferData(target, content, gl.STATIC_DRAW);
    };
    const array = (attributes, corners) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      attributes.forEach(([content, type, stride], k) => {
        fill(gl.ARRAY_BUFFER, content);
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, 3, type, true, stride, 0);
      });
      if (corners) fill(gl.ELEMENT_ARRAY_BUFFER, corners);
      gl.bindVertexArray(null);
      return array;
    };
    gpu = {
      surface: program(SURFACE),
      points: program(POINTS),
      mesh: array([[data.positions, gl.UNSIGNED_SHORT, 6], [data.normals, gl.BYTE, 4]], data.corners),
      cloud: array([[data.points, gl.UNSIGNED_SHORT, 6]]),
    };
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
  }

  // Angles about the axis that points up, and above the horizon.
  const VIEWS = { front: [0, 0], oblique: [0.72, 0.38], top: [0, Math.PI / 2] };
  let azimuth, elevation, zoom, shiftX, shiftY;
  function look(name) {
    [azimuth, elevation] = VIEWS[name];
    [zoom, shiftX, shiftY] = [1.2, 0, 0];
    redraw();
  }

  // Rows: to the right, up and towards the viewer.
  function axes() {
    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    const rows = [[ca, 0, -sa], [-sa * se, ce, -ca * se], [sa * ce, se, ca * ce]];
    // In maps and machines the front looks along y: z takes the place of y, and −y that of z.
    return zUp ? rows.map(([x, y, z]) => [x, -z, y]) : rows;
  }

  const shows = { surface: document.getElementById("show-surface"), points: document.getElementById("show-points") };
  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(draw);
  }
  function draw() {
    waiting = false;
    if (!gpu || gl.isContextLost()) return;
    const dense = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * dense)), height = Math.max(1, Math.round(canvas.clientHeight * dense));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const short = Math.min(width, height), rows = axes();
    const turn = [0, 1, 2].flatMap((column) => rows.map((row) => row[column]));
    const use = ({ program, at }, nearer) => {
      gl.useProgram(program);
      gl.uniformMatrix3fv(at.turn, false, turn);
      gl.uniform3fv(at.size, size);
      gl.uniform1f(at.radius, radius);
      gl.uniform2f(at.zoom, zoom * short / width, zoom * short / height);
      gl.uniform2f(at.shift, shiftX * short / width, shiftY * short / height);
      gl.uniform1f(at.nearer, nearer);
      return at;
    };
    if (shows.surface.checked) {
      use(gpu.surface, 0);
      gl.bindVertexArray(gpu.mesh);
      gl.drawElements(gl.TRIANGLES, cornerCount, gl.UNSIGNED_INT, 0);
    }
    if (shows.points.checked) {
      const at = use(gpu.points, 0.002);
      // About a third of the distance between points that are spread over a ball.
      const apart = zoom * short / Math.sqrt(Math.max(pointCount, 1));
      gl.uniform1f(at.pixels, Math.min(Math.max(0.33 * apart, 1.5 * dense), 8 * dense));
      gl.bindVertexArray(gpu.cloud);
      gl.drawArrays(gl.POINTS, 0, pointCount);
    }
    gl.bindVertexArray(null);
    canvas.dataset.state = "drawn";
  }

  const half = () => Math.min(canvas.clientWidth, canvas.clientHeight) / 2;
  function rotate(dx, dy) {
    azimuth -= 0.008 * dx;
    elevation = Math.min(Math.max(elevation + 0.008 * dy, -Math.PI / 2), Math.PI / 2);
    redraw();
  }
  function move(dx, dy) {
    shiftX += dx / half();
    shiftY -= dy / half();
    redraw();
  }
  // What is at the place (in pixels of the window) stays there.
  function magnify(factor, x, y) {
    const box = canvas.getBoundingClientRect();
    const atX = x === undefined ? 0 : (x - box.left - box.width / 2) / half();
    const atY = y === undefined ? 0 : -(y - box.top - box.height / 2) / half();
    const next = Math.min(Math.max(zoom * factor, 0.2), 200);
    shiftX = atX + (shiftX - atX) * next / zoom;
    shiftY = atY + (shiftY - atY) * next / zoom;
    zoom = next;
    redraw();
  }

  const held = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    if (held.size === 1) {
      if (event.shiftKey || event.buttons & 6) move(dx, dy);
      else rotate(dx, dy);
    } else {
      const other = [...held].find(([id]) => id !== event.pointerId)[1];
      const apart = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
      move(dx / 2, dy / 2);
      magnify(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    held.set(event.pointerId, now);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    // Whoever only scrolls by is not held up.
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    magnify(Math.exp(-0.0015 * lines * event.deltaY), event.clientX, event.clientY);
  }, { passive: false });
  canvas.addEventListener("dblclick", () => look("oblique"));
  const KEYS = {
    ArrowLeft: () => rotate(-12, 0), ArrowRight: () => rotate(12, 0), ArrowUp: () => rotate(0, -12), ArrowDown: () => rotate(0, 12),
    "+": () => magnify(1.2), "=": () => magnify(1.2), "-": () => magnify(1 / 1.2), 0: () => look("oblique"),
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => look(button.dataset.view));
  for (const box of Object.values(shows)) box.addEventListener("change", redraw);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => { build(); redraw(); });
  new ResizeObserver(redraw).observe(canvas);
  build();
  look("oblique");
})();
