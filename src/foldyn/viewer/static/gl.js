// Draws sheets with WebGL2. Positions of all nodes, with a level each, are one texture of floats that
// is filled anew for every picture; panels and lines look their nodes up in it.
import { BAR, BOUNDARY, HIDDEN, KINDS, ramp, rgb } from "./colors.js";

const ROW = 1024; // texels

const COMMON = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D;
uniform sampler2D nodes, levels;
uniform vec3 center;
uniform mat4 projection;  // of positions relative to the center
vec4 node(uint k) { return texelFetch(nodes, ivec2(k % ${ROW}u, k / ${ROW}u), 0); }
float levelOf(uint k) { return texelFetch(levels, ivec2(k % ${ROW}u, k / ${ROW}u), 0).r; }
vec4 seen(vec3 p) { return projection * vec4(p - center, 1.0); }`;

const PANEL_VERTEX = `${COMMON}
layout(location = 0) in uint corner;
layout(location = 1) in uint panel;
uniform int on;  // 0 paper, 1 levels of nodes, 2 of panels
out vec3 place; out float level; flat out float whole;
void main() {
  vec4 p = node(corner);
  place = p.xyz;
  level = p.w;
  whole = on == 2 ? levelOf(panel) : 0.0;  // of the triangles whose last corner this is
  gl_Position = seen(p.xyz);
}`;

const PANEL_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
in vec3 place; in float level; flat in float whole; out vec4 color;
uniform int on; uniform vec3 front, back, light, toward; uniform float alpha;
uniform sampler2D colormap;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float bright = 0.62 + 0.32 * abs(dot(normal, light)) + 0.1 * abs(dot(normal, toward));
  vec3 base = gl_FrontFacing ? front : back;
  if (on > 0) {
    float own = on == 2 ? whole : level;
    base = texture(colormap, vec2(clamp(own, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb;
    bright = 0.4 + 0.6 * bright;
  }
  color = vec4(base * bright, alpha);
}`;

const LINE_VERTEX = `${COMMON}
layout(location = 0) in uvec2 ends;  // the same at the four corners of a line
layout(location = 1) in uint kind;
layout(location = 2) in vec2 along;
layout(location = 3) in uint element;
uniform vec2 pixels;  // half the view
uniform float widths[6], fine; uniform bool told; uniform float nearer;
flat out uint k; flat out float level, width; out float s, across;
void main() {
  float t = float(gl_VertexID & 1), side = float(gl_VertexID >> 1 & 1) * 2.0 - 1.0;
  vec4 a = seen(node(ends.x).xyz), b = seen(node(ends.y).xyz);
  vec2 d = (b.xy / b.w - a.xy / a.w) * pixels;
  float l = length(d);
  d = l > 1e-4 ? d / l : vec2(1.0, 0.0);
  k = kind;
  level = told && kind != ${BOUNDARY}u ? levelOf(element) : -1.0;
  width = widths[kind];
  if (level >= 0.0) width = max(width, (1.5 + 4.0 * abs(level - 0.5) * width) * fine);
  float reach = 0.5 * width + 0.7;
  across = side * reach;
  s = mix(along.x, along.y, t);
  gl_Position = mix(a, b, t);
  vec2 aside = vec2(-d.y, d.x) * across + d * (2.0 * t - 1.0) * 0.3 * width;
  gl_Position.xy += aside / pixels * gl_Position.w;
  gl_Position.z -= nearer * gl_Position.w;
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float; precision highp int;
flat in uint k; flat in float level, width; in float s, across; out vec4 color;
uniform vec3 colors[6]; uniform float drawn[6]; uniform float alpha, period;
uniform sampler2D colormap;
void main() {
  float cover = clamp(0.5 * width + 0.5 - abs(across), 0.0, 1.0);
  vec3 tone = colors[k];
  if (level >= 0.0) tone = texture(colormap, vec2(clamp(level, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb;
  else if (drawn[k] < 1.0) {
    float blur = fwidth(s) / period, place = abs(fract(s / period) - 0.5) * 2.0;
    cover *= blur > 0.35 ? drawn[k] : clamp((drawn[k] - place) / max(2.0 * blur, 1e-6) + 0.5, 0.0, 1.0);
  }
  if (alpha * cover < 0.01) discard;
  color = vec4(tone, alpha * cover);
}`;

const HALVES = [0, 1, 2, 2, 1, 3]; // corners of the two triangles of a line

// Rows of some size, each four times.
function fourfold(array, size) {
  const out = new array.constructor(4 * array.length);
  for (let k = 0; k < out.length; k++) out[k] = array[size * Math.floor(k / (4 * size)) + (k % size)];
  return out;
}

// Triangles whose last corner says which panel they belong to: a node of this panel alone, or one
// more that lies where a node does. Corners are as few as can be: software transforms each of them.
function cornered({ triangles, panel, count }) {
  const owner = new Int32Array(count).fill(-1);
  triangles.forEach((node, k) => {
    const own = panel[Math.floor(k / 3)];
    owner[node] = owner[node] === -1 || owner[node] === own ? own : -2;
  });
  const corner = Array.from(owner, (_, k) => k);
  const panels = Array.from(owner, (own) => Math.max(own, 0));
  const out = new Uint32Array(triangles.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const own = [0, 1, 2].find((k) => owner[triangles[t + k]] >= 0);
    for (let k = 0; k < 3; k++) out[t + k] = triangles[t + ((k + (own ?? 2) + 1) % 3)];
    if (own !== undefined) continue;
    corner.push(out[t + 2]);
    panels.push(panel[t / 3]);
    out[t + 2] = corner.length - 1;
  }
  return { corner: Uint32Array.from(corner), panel: Uint32Array.from(panels), triangles: out };
}

const unit = (hex) => rgb(hex).map((value) => value / 255);
const solid = ({ dash }) => {
  const total = dash.reduce((a, b) => a + b, 0);
  return total ? dash.filter((_, k) => k % 2 === 0).reduce((a, b) => a + b, 0) / total : 1;
};
const DRAWN = KINDS.map(solid); // part of a dashed line that is drawn

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

export class GLPainter {
  // Without a graphics processor the canvas painter is several times as fast, unless `anyhow`.
  constructor(canvas, anyhow) {
    const gl = canvas.getContext("webgl2", { antialias: true });
    if (!gl) throw new Error("the browser has no WebGL2");
    const told = gl.getExtension("WEBGL_debug_renderer_info");
    if (!anyhow && SOFTWARE.test(gl.getParameter(told?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER))) {
      throw new Error("WebGL2 is drawn by software");
    }
    this.gl = gl;
    this.canvas = canvas;
    this.panels = this.program(PANEL_VERTEX, PANEL_FRAGMENT);
    this.lines = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.maps = {};
    for (const name of ["sequential", "diverging"]) {
      this.maps[name] = this.texture();
      const size = [gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE];
      gl.texImage2D(gl.TEXTURE_2D, 0, ...size, ramp(name));
    }
    this.scratch = { nodes: this.texture(), levels: this.texture(), rows: {} };
  }

  program(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
        throw new Error(gl.getShaderInfoLog(shader) || "a shader does not compile");
      }
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(program) || "shaders do not link");
    }
    const at = {};
    for (let k = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; k >= 0; k--) {
      const { name } = gl.getActiveUniform(program, k);
      at[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  texture() {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, key, gl.NEAREST);
    }
    for (const key of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, key, gl.CLAMP_TO_EDGE);
    }
    return texture;
  }

  // Buffers of a sheet at rest: what does not change from picture to picture.
  sheet(sheet) {
    const { gl } = this;
    const buffers = [];
    const stored = (target, array) => {
      const buffer = gl.createBuffer();
      buffers.push(buffer);
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, array, gl.STATIC_DRAW);
    };
    const filled = (location, array, size) => {
      stored(gl.ARRAY_BUFFER, array);
      gl.enableVertexAttribArray(location);
      if (array instanceof Float32Array) {
        gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
      } else gl.vertexAttribIPointer(location, size, gl.UNSIGNED_INT, 0, 0);
    };
    const arrays = (fill) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      fill();
      return vao;
    };
    // four corners each: instances of a few corners are slow in software
    const lines = (ends, kind, along, element) => ({
      vao: arrays(() => {
        filled(0, fourfold(ends, 2), 2);
        filled(1, fourfold(kind, 1), 1);
        filled(2, fourfold(along, 2), 2);
        filled(3, fourfold(element, 1), 1);
        const corners = Uint32Array.from({ length: 3 * ends.length }, (_, k) => 4 * Math.floor(k / 6) + HALVES[k % 6]);
        stored(gl.ELEMENT_ARRAY_BUFFER, corners);
      }),
      count: ends.length / 2,
    });
    const { corner, panel, triangles } = cornered(sheet);
    const made = {
      panels: {
        vao: arrays(() => {
          filled(0, corner, 1);
          filled(1, panel, 1);
          stored(gl.ELEMENT_ARRAY_BUFFER, triangles);
        }),
        count: triangles.length,
      },
      edges: lines(sheet.edges, Uint32Array.from(sheet.kind), sheet.along, sheet.crease),
    };
    made.inner = sheet.inner;
    if (sheet.bars) {
      const count = sheet.bars.length / 2;
      const numbers = Uint32Array.from({ length: count }, (_, k) => k);
      const kind = new Uint32Array(count).fill(BAR);
      made.bars = lines(sheet.bars, kind, new Float32Array(2 * count), numbers);
    }
    gl.bindVertexArray(null);
    made.free = () => {
      for (const part of [made.panels, made.edges, made.bars]) {
        if (part) gl.deleteVertexArray(part.vao);
      }
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    };
    return made;
  }

  begin() {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  // Draw one sheet, `made` by `sheet`, with nodes at `positions` (3n), into a part of the canvas in
  // pixels of the page, y down. `shown` has "on" ("node", "panel", "crease", "bar") and "levels"
  // from 0 to 1, or is null.
  draw(made, positions, shown, view, camera, look) {
    const { gl } = this;
    const { dpr } = look;
    this.fill("nodes", this.placed(positions, shown?.on === "node" ? shown.levels : null), 4);
    if (shown && shown.on !== "node") this.fill("levels", this.rowed(shown.levels), 1);
    const height = view.height * dpr;
    gl.viewport(view.x * dpr, this.canvas.height - view.y * dpr - height, view.width * dpr, height);
    const [, , toward] = camera.basis;
    const projection = camera.matrix(view);
    const use = ({ program, at }) => {
      gl.useProgram(program);
      gl.uniform3fv(at.center, camera.center);
      gl.uniformMatrix4fv(at.projection, true, projection);
      const map = this.maps[look.map ?? "sequential"];
      const textures = [["nodes", this.scratch.nodes], ["levels", this.scratch.levels], ["colormap", map]];
      textures.forEach(([name, texture], k) => {
        gl.activeTexture(gl.TEXTURE0 + k);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.uniform1i(at[name], k);
      });
      return at;
    };

    let at = use(this.panels);
    gl.uniform1i(at.on, shown ? { node: 1, panel: 2 }[shown.on] ?? 0 : 0);
    gl.uniform3fv(at.light, camera.light);
    gl.uniform3fv(at.toward, toward);
    gl.uniform3fv(at.front, unit(look.front));
    gl.uniform3fv(at.back, unit(look.back));
    gl.uniform1f(at.alpha, look.alpha);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    gl.bindVertexArray(made.panels.vao);
    const panels = () => gl.drawElements(gl.TRIANGLES, made.panels.count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.BLEND);
    if (look.alpha < 1) { // of see-through sheets only what is in front, each sheet for itself
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.colorMask(false, false, false, false);
      panels();
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND);
    }
    panels();
    gl.disable(gl.POLYGON_OFFSET_FILL);

    at = use(this.lines);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.uniform2f(at.pixels, view.width / 2, view.height / 2);
    gl.uniform1fv(at.widths, look.kinds.map((kind) => kind.width));
    gl.uniform3fv(at.colors, look.kinds.flatMap((kind) => unit(kind.color)));
    gl.uniform1fv(at.drawn, DRAWN);
    gl.uniform1f(at.fine, look.fine);
    gl.uniform1f(at.period, look.period);
    gl.uniform1f(at.nearer, 1e-4);
    const lines = (part, told, first, end, opacity) => {
      if (opacity === 0 || first === end) return;
      gl.bindVertexArray(part.vao);
      gl.uniform1i(at.told, told ? 1 : 0);
      for (const [visible, alpha] of look.faint ? [[false, HIDDEN], [true, 1]] : [[true, 1]]) {
        if (visible) gl.enable(gl.DEPTH_TEST);
        else gl.disable(gl.DEPTH_TEST); // what is hidden shines through, faintly
        gl.uniform1f(at.alpha, alpha * opacity);
        gl.drawElements(gl.TRIANGLES, 6 * (end - first), gl.UNSIGNED_INT, 24 * first);
      }
      gl.enable(gl.DEPTH_TEST);
    };
    if (made.bars && shown?.on === "bar") lines(made.bars, true, 0, made.bars.count, 1);
    lines(made.edges, shown?.on === "crease", 0, made.inner, look.lines);
    lines(made.edges, false, made.inner, made.edges.count, 1);
    gl.depthMask(true);
    if (look.ghost) gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.bindVertexArray(null);
  }

  // Positions with the levels of nodes, in whole rows of a texture.
  placed(positions, levels) {
    const count = positions.length / 3;
    const out = this.room("nodes", 4 * ROW * Math.ceil(count / ROW));
    for (let k = 0, from = 0, to = 0; k < count; k++, from += 3, to += 4) {
      out[to] = positions[from];
      out[to + 1] = positions[from + 1];
      out[to + 2] = positions[from + 2];
      out[to + 3] = levels ? levels[k] : 0;
    }
    return out;
  }

  rowed(levels) {
    const out = this.room("levels", ROW * Math.max(1, Math.ceil(levels.length / ROW)));
    out.set(levels);
    return out;
  }

  room(name, size) {
    const { scratch } = this;
    const key = `${name}Room`;
    if (scratch[key]?.length !== size) scratch[key] = new Float32Array(size);
    return scratch[key];
  }

  fill(name, array, channels) {
    const { gl, scratch } = this;
    const rows = array.length / channels / ROW;
    const [inner, outer] = channels === 4 ? [gl.RGBA32F, gl.RGBA] : [gl.R32F, gl.RED];
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, scratch[name]);
    if (scratch.rows[name] === rows) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, outer, gl.FLOAT, array);
    } else gl.texImage2D(gl.TEXTURE_2D, 0, inner, ROW, rows, 0, outer, gl.FLOAT, array);
    scratch.rows[name] = rows;
  }
}
