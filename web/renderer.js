// Draws instances of small meshes with WebGL2: a draw call for each mesh, and one more for its shadow on level ground. Marks over the world are drawn
// last, without shadows; their kind is the opacity, negative.

// Numbers of a vertex (a, b, c, normal) and of an instance (place, rotation, sizes, colour, kind), as crates/play writes them.
const VERTEX = 12;
const INSTANCE = 14;
// Mesh of level ground.
const SQUARE = 3;
// Meshes of marks, the last ones.
const MARKS = 3;
const SKY = [0.875, 0.91, 0.933];
// Direction to the sun.
const SUN = [0.42, -0.35, 0.84];

const VERTEX_SHADER = `#version 300 es
precision highp float;
layout(location = 0) in vec3 a;
layout(location = 1) in vec3 b;
layout(location = 2) in vec3 c;
layout(location = 3) in vec3 normal;
layout(location = 4) in vec3 place;
layout(location = 5) in vec4 turn;
layout(location = 6) in vec3 sizes;
layout(location = 7) in vec3 colour;
layout(location = 8) in float kind;
uniform mat4 clip_world;
uniform vec3 sun;
uniform bool shadow;
out vec3 at;
out vec3 up;
out vec3 tint;
flat out float what;
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
void main() {
  at = place + turned(turn, a * sizes.x + b * sizes.y + c * sizes.z);
  up = turned(turn, normal);
  tint = colour;
  what = kind;
  // Onto the ground along the light, a little above it.
  if (shadow) at = vec3(at.xy - sun.xy / sun.z * max(at.z, 0.0), 0.003);
  gl_Position = clip_world * vec4(at, 1.0);
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec3 at;
in vec3 up;
in vec3 tint;
flat in float what;
uniform vec3 eye;
uniform vec3 sun;
uniform vec3 sky;
uniform bool shadow;
out vec4 colour;
void main() {
  if (shadow) { colour = vec4(0.36, 0.35, 0.33, 1.0); return; }
  vec3 to_eye = eye - at;
  vec3 n = dot(up, up) > 0.0 ? normalize(up) : normalize(cross(dFdx(at), dFdy(at)));
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 base = tint;
  if (what > 0.5) {
    // Lines a metre apart.
    vec2 cell = abs(fract(at.xy - 0.5) - 0.5) / fwidth(at.xy);
    base *= mix(0.9, 1.0, clamp(min(cell.x, cell.y), 0.0, 1.0));
  }
  float light = 0.62 + 0.18 * n.z + 0.42 * max(dot(n, sun), 0.0);
  vec3 shown = base * light;
  if (what < -0.001) { colour = vec4(mix(shown, base, 0.5), min(-what, 1.0)); return; }
  float far = what > 0.5 ? smoothstep(4.0, 11.5, length(at.xy)) : 0.0;
  colour = vec4(mix(shown, sky, far), 1.0);
}`;

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`the graphics driver refuses a shader: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
}

export class Renderer {
  // Throws without WebGL2.
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!this.gl) throw new Error("no WebGL2");
    this.meshes = [];
    this.drawCalls = 0;
    this.start();
  }

  // Makes what the context holds; again after the context was lost.
  start() {
    const gl = this.gl;
    this.program = program(gl);
    gl.useProgram(this.program);
    const place = name => gl.getUniformLocation(this.program, name);
    this.uniforms = Object.fromEntries(["clip_world", "eye", "sun", "sky", "shadow"].map(name => [name, place(name)]));
    const length = Math.hypot(...SUN);
    gl.uniform3fv(this.uniforms.sun, SUN.map(x => x / length));
    gl.uniform3fv(this.uniforms.sky, SKY);
    gl.clearColor(...SKY, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniform1i(this.uniforms.shadow, 0);
    this.instances = gl.createBuffer();
    if (this.kept) this.setMeshes(...this.kept);
  }

  // Takes the vertices of all meshes, and their number for each.
  setMeshes(vertices, counts) {
    const gl = this.gl;
    this.kept = [vertices, counts];
    for (const mesh of this.meshes) { gl.deleteVertexArray(mesh.array); gl.deleteBuffer(mesh.buffer); }
    let first = 0;
    this.meshes = counts.map(count => {
      const array = gl.createVertexArray(), buffer = gl.createBuffer();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, vertices.subarray(first * VERTEX, (first + count) * VERTEX), gl.STATIC_DRAW);
      for (let k = 0; k < 4; k += 1) {
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 4 * VERTEX, 12 * k);
      }
      for (let k = 4; k < 9; k += 1) { gl.enableVertexAttribArray(k); gl.vertexAttribDivisor(k, 1); }
      first += count;
      return { array, buffer, count };
    });
  }

  // Takes the instances of all meshes, and their number for each.
  setInstances(instances, counts) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, instances, gl.DYNAMIC_DRAW);
    this.counts = counts;
    // Level ground has a mesh of its own; shadows on terrain would need another way.
    this.level = counts[SQUARE] > 0;
  }

  draw(view) {
    const gl = this.gl, { canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.counts || gl.isContextLost()) return;
    gl.uniformMatrix4fv(this.uniforms.clip_world, false, view.clipWorld(width / height));
    gl.uniform3fv(this.uniforms.eye, view.eye());
    this.drawCalls = 0;
    const marks = this.counts.length - MARKS;
    this.pass(k => k < marks);
    if (this.level) {
      gl.uniform1i(this.uniforms.shadow, 1);
      this.pass(k => k < marks && k !== SQUARE);
      gl.uniform1i(this.uniforms.shadow, 0);
    }
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    this.pass(k => k >= marks);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  // Draws the instances of the meshes for which `is` is true.
  pass(is) {
    const gl = this.gl;
    let first = 0;
    this.counts.forEach((count, k) => {
      const mesh = this.meshes[k];
      if (count > 0 && mesh && is(k)) {
        gl.bindVertexArray(mesh.array);
        gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
        let offset = first * 4 * INSTANCE;
        for (const [at, size] of [[4, 3], [5, 4], [6, 3], [7, 3], [8, 1]]) {
          gl.vertexAttribPointer(at, size, gl.FLOAT, false, 4 * INSTANCE, offset);
          offset += 4 * size;
        }
        gl.drawArraysInstanced(gl.TRIANGLES, 0, mesh.count, count);
        this.drawCalls += 1;
      }
      first += count;
    });
  }
}
