// plan.html: shows the scene that stands in the page. Metres, seconds, z up. Nothing of the air is
// computed here: it comes as samples, and wakes as levels with a delay each.
'use strict';
(() => {
const $ = id => document.getElementById(id);
const wrong = text => { $('wrong').textContent = text; $('wrong').hidden = false; document.documentElement.dataset.state = 'failed'; };
addEventListener('error', event => { document.documentElement.dataset.error = event.message; wrong('This page failed: ' + event.message); });
const data = JSON.parse($('scene').textContent);
const UNIT = 1e-4, fleet = data.drones.length, end = Math.max(data.end_s, 0.01);
const MANY = 150, many = fleet > MANY;
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// What the page holds in whole units, in metres and seconds again.
const decode64 = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
for (const [index, drone] of data.drones.entries()) {
  drone.index = index;
  let at = 0;
  drone.t = Float64Array.from(drone.t, step => (at += step) * UNIT);
  const place = [0, 0, 0];
  drone.p = Float64Array.from(drone.p, (step, k) => (place[k % 3] += step) * UNIT);
  drone.air = drone.air ? decode64(drone.air) : null;
}

// The piece under way: the last point at or before a time.
const after = (times, at) => {
  let low = 0, high = times.length;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] <= at) low = middle + 1; else high = middle; }
  return low;
};
// Where a drone is; the one place that knows what pieces are. `out` holds place and velocity.
const locate = (drone, at, out) => {
  const { t, p } = drone, last = t.length - 1, next = after(t, at);
  out[3] = out[4] = out[5] = 0;
  const k = next - 1;
  if (next === 0 || k >= last) {
    const base = 3 * (next === 0 ? 0 : last);
    out[0] = p[base]; out[1] = p[base + 1]; out[2] = p[base + 2];
    return out;
  }
  const length = t[k + 1] - t[k], u = (at - t[k]) / length, v = 1 - u, inner = drone.c[k];
  for (let axis = 0; axis < 3; axis++) {
    const a = p[3 * k + axis], d = p[3 * k + 3 + axis];
    if (inner && inner.length === 6) {
      const b = a + inner[axis] * UNIT, c = a + inner[3 + axis] * UNIT;
      out[axis] = v * v * v * a + 3 * v * v * u * b + 3 * v * u * u * c + u * u * u * d;
      out[3 + axis] = 3 * (v * v * (b - a) + 2 * v * u * (c - b) + u * u * (d - c)) / length;
    } else {
      out[axis] = a + u * (d - a);
      out[3 + axis] = (d - a) / length;
    }
  }
  return out;
};
const isThere = (drone, at) => (drone.enters_s === null || at >= drone.enters_s - 1e-9) && !(drone.leaves && at > drone.t[drone.t.length - 1] + 1e-9);
const isAirborne = (drone, at) => { const [from, until] = drone.airborne_s; return at >= from && (until === null || at < until || drone.leaves && at <= until + 1e-9); };
const airAt = (drone, at) => {
  if (!drone.air) return 0;
  const k = Math.max(0, Math.min(at / data.step_s, drone.air.length - 1)), low = Math.floor(k), high = Math.min(low + 1, drone.air.length - 1);
  return (drone.air[low] + (k - low) * (drone.air[high] - drone.air[low])) / 255 * data.max_air_mps;
};
// Mean air of its alpha of 0, of 1 and of its limit, with what it carries at a time.
const alphaMps = (drone, at) => stepped(drone.alpha_mps, Math.max(after(drone.t, at) - 1, 0))[1];
const limitMps = (drone, at) => alphaMps(drone, at)[2];
const stepped = (list, at) => { let low = 0, high = list.length; while (low < high) { const m = (low + high) >> 1; if (list[m][0] <= at + 1e-6) low = m + 1; else high = m; } return list[Math.max(low - 1, 0)]; };

// The scene.
const T = THREE;
let renderer;
try {
  renderer = new T.WebGLRenderer({ canvas: $('view'), antialias: !many, preserveDrawingBuffer: true });
} catch (error) {
  wrong('This browser shows no WebGL 2: plan.svg beside this file needs none.');
  return;
}
renderer.setPixelRatio(Math.min(devicePixelRatio || 1, many ? 1 : 2));
const scene = new T.Scene();
const camera = new T.PerspectiveCamera(45, 1, 0.05, 5000);
camera.up.set(0, 0, 1);
const controls = new T.OrbitControls(camera, $('view'));
controls.maxPolarAngle = Math.PI * 0.55;
const { min: low, max: high } = data.bounds_m;
const size = [0, 1, 2].map(k => high[k] - low[k]), middle = [0, 1, 2].map(k => (low[k] + high[k]) / 2);
const sky = new T.HemisphereLight(0xffffff, 0x8899aa, 2.2), sun = new T.DirectionalLight(0xffffff, 1.4);
sun.position.set(middle[0] - size[0], middle[1] - 2 * size[1], high[2] + 2 * size[0]);
scene.add(sky, sun);

// Place: floor with a grid in whole metres, edges of the bounds.
const flat = colour => new T.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.9 });
const floorLook = new T.MeshBasicMaterial({}), gridLook = flat(0), edgeLook = flat(0);
const floor = new T.Mesh(new T.PlaneGeometry(size[0], size[1]), floorLook);
floor.position.set(middle[0], middle[1], low[2] - 0.01);
scene.add(floor);
const lines = (places, look) => {
  const geometry = new T.BufferGeometry();
  geometry.setAttribute('position', new T.BufferAttribute(new Float32Array(places), 3));
  const drawn = new T.LineSegments(geometry, look);
  drawn.frustumCulled = false;
  scene.add(drawn);
  return drawn;
};
const cell = [1, 2, 5, 10, 20, 50, 100, 200, 500].find(step => Math.max(size[0], size[1]) / step <= 40) || 1000;
const grid = [];
for (let x = Math.ceil(low[0] / cell) * cell; x <= high[0] + 1e-6; x += cell) grid.push(x, low[1], low[2], x, high[1], low[2]);
for (let y = Math.ceil(low[1] / cell) * cell; y <= high[1] + 1e-6; y += cell) grid.push(low[0], y, low[2], high[0], y, low[2]);
lines(grid, gridLook);
const boxEdges = (a, b) => {
  const out = [], corner = k => [k & 1 ? b[0] : a[0], k & 2 ? b[1] : a[1], k & 4 ? b[2] : a[2]];
  for (let k = 0; k < 8; k++) for (const bit of [1, 2, 4]) if (!(k & bit)) out.push(...corner(k), ...corner(k | bit));
  return out;
};
lines(boxEdges(low, high), edgeLook);

// Obstacles: boxes in one instanced mesh, and one set of edges for all.
const solidLook = new T.MeshLambertMaterial({ transparent: true, opacity: 0.92 });
const solidEdges = [], boxes = data.obstacles.filter(it => it.min_m);
const matrix = new T.Matrix4();
if (boxes.length) {
  const mesh = new T.InstancedMesh(new T.BoxGeometry(1, 1, 1), solidLook, boxes.length);
  boxes.forEach((box, k) => {
    const s = [0, 1, 2].map(i => box.max_m[i] - box.min_m[i]);
    matrix.makeScale(s[0], s[1], s[2]).setPosition((box.min_m[0] + box.max_m[0]) / 2, (box.min_m[1] + box.max_m[1]) / 2, (box.min_m[2] + box.max_m[2]) / 2);
    mesh.setMatrixAt(k, matrix);
    solidEdges.push(...boxEdges(box.min_m, box.max_m));
  });
  mesh.frustumCulled = false;
  scene.add(mesh);
}
for (const solid of data.obstacles) {
  if (solid.base_m) {
    const mesh = new T.Mesh(new T.CylinderGeometry(solid.radius_m, solid.radius_m, solid.height_m, 32).rotateX(Math.PI / 2), solidLook);
    mesh.position.set(solid.base_m[0], solid.base_m[1], solid.base_m[2] + solid.height_m / 2);
    scene.add(mesh);
  } else if (solid.vertices_m) {
    const geometry = new T.BufferGeometry();
    geometry.setAttribute('position', new T.BufferAttribute(new Float32Array(solid.vertices_m.flat()), 3));
    geometry.setIndex(solid.triangles.flat());
    geometry.computeVertexNormals();
    scene.add(new T.Mesh(geometry, solidLook));
  }
}
const solidEdgeLook = flat(0);
if (solidEdges.length) lines(solidEdges, solidEdgeLook);
const zoneLook = new T.MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false, side: T.DoubleSide }), zoneEdges = [], zoneEdgeLook = flat(0);
for (const zone of data.zones) {
  const s = [0, 1, 2].map(i => zone.max_m[i] - zone.min_m[i]);
  const mesh = new T.Mesh(new T.BoxGeometry(s[0], s[1], s[2]), zoneLook);
  mesh.position.set(...[0, 1, 2].map(i => (zone.min_m[i] + zone.max_m[i]) / 2));
  mesh.renderOrder = 1;
  scene.add(mesh);
  zoneEdges.push(...boxEdges(zone.min_m, zone.max_m));
}
if (zoneEdges.length) lines(zoneEdges, zoneEdgeLook);

// Drones: one instanced mesh. Real ones are too small to see: drawn at least so large (m).
const LEAST_M = Math.max(0.22, Math.max(...size) / (many ? 200 : 80));
const merge = parts => {
  const all = parts.map(part => part.index ? part.toNonIndexed() : part), geometry = new T.BufferGeometry();
  for (const name of ['position', 'normal']) {
    const total = all.reduce((sum, part) => sum + part.attributes[name].array.length, 0), values = new Float32Array(total);
    let offset = 0;
    for (const part of all) { values.set(part.attributes[name].array, offset); offset += part.attributes[name].array.length; }
    geometry.setAttribute(name, new T.BufferAttribute(values, 3));
  }
  return geometry;
};
const craft = () => {
  if (many) return new T.SphereGeometry(1, 8, 5).scale(1, 1, 0.6);
  const parts = [new T.SphereGeometry(0.34, 14, 8).scale(1, 1, 0.62)];
  for (let k = 0; k < 4; k++) {
    const turn = Math.PI / 4 + k * Math.PI / 2, x = 0.64 * Math.cos(turn), y = 0.64 * Math.sin(turn);
    parts.push(new T.BoxGeometry(0.66, 0.09, 0.07).translate(0.33, 0, 0).rotateZ(turn));
    parts.push(new T.TorusGeometry(0.34, 0.055, 6, 20).translate(x, y, 0.06));
  }
  return merge(parts);
};
const drones = new T.InstancedMesh(craft(), new T.MeshLambertMaterial({ color: 0xffffff }), Math.max(fleet, 1));
drones.count = fleet;
drones.frustumCulled = false;
scene.add(drones);
const halo = new T.Mesh(new T.TorusGeometry(1.35, 0.09, 6, 36), new T.MeshBasicMaterial({}));
halo.visible = false;
scene.add(halo);

// Wakes: one instanced tube, each level's centre and radius from a texture.
const levels = Math.max(2, ...data.wakes.map(wake => wake.length)), around = many ? 10 : 22;
const rings = new Float32Array(Math.max(fleet, 1) * levels * 4);
const ringTexture = new T.DataTexture(rings, levels, Math.max(fleet, 1), T.RGBAFormat, T.FloatType);
const tints = new Float32Array(Math.max(fleet, 1));
const tube = new T.InstancedBufferGeometry(), corners = [], faces = [];
for (let level = 0; level < levels; level++) for (let k = 0; k < around; k++) corners.push(level, k / around * 2 * Math.PI, 0);
for (let level = 0; level + 1 < levels; level++) for (let k = 0; k < around; k++) {
  const a = level * around + k, b = level * around + (k + 1) % around;
  faces.push(a, b, a + around, b, b + around, a + around);
}
tube.setAttribute('position', new T.BufferAttribute(new Float32Array(corners), 3));
tube.setIndex(faces);
tube.instanceCount = fleet;
const tintAttribute = new T.InstancedBufferAttribute(tints, 1);
tube.setAttribute('tint', tintAttribute);
const wakeLook = new T.ShaderMaterial({
  transparent: true, depthWrite: false, side: T.DoubleSide,
  uniforms: { rings: { value: ringTexture }, plain: { value: new T.Color() }, met: { value: new T.Color() }, strength: { value: 1 } },
  vertexShader: `uniform sampler2D rings; attribute float tint; varying float shade; varying float kind; varying vec3 towards; varying vec3 side;
    void main() { vec4 ring = texelFetch(rings, ivec2(int(position.x + 0.5), gl_InstanceID), 0);
      vec3 outward = vec3(cos(position.y), sin(position.y), 0.0);
      vec4 seen = modelViewMatrix * vec4(ring.xyz + ring.w * outward, 1.0);
      shade = 1.0 - position.x / ${(levels - 1).toFixed(1)}; kind = tint; towards = -seen.xyz; side = normalMatrix * outward;
      gl_Position = projectionMatrix * seen; }`,
  fragmentShader: `uniform vec3 plain; uniform vec3 met; uniform float strength; varying float shade; varying float kind; varying vec3 towards; varying vec3 side;
    void main() { float rim = 1.0 - abs(dot(normalize(towards), normalize(side)));
      float most = kind > 0.5 ? 0.42 : 0.3;
      gl_FragColor = vec4(mix(plain, met, kind), strength * most * (0.25 + 0.75 * shade) * (0.45 + 0.9 * rim));
      #include <colorspace_fragment>
    }`,
});
const wakes = new T.Mesh(tube, wakeLook);
wakes.frustumCulled = false;
wakes.renderOrder = 2;
if (data.wakes.length) scene.add(wakes);
const spot = new Float64Array(6);
// The wake of a drone as it is at a time: each level left when its air was under way for so long.
const hang = (drone, now) => {
  const base = drone.index * levels * 4;
  const hide = from => { for (let k = from; k < levels; k++) rings[base + 4 * k + 3] = 0; };
  if (!isThere(drone, now) && !data.convection) return hide(0);
  const kindAt = at => { const found = drone.w.length ? stepped(drone.w, Math.max(after(drone.t, at) - 1, 0))[1] : null; return found === null ? null : data.wakes[found]; };
  let shape = kindAt(now);
  if (!shape) return hide(0);
  let cut = -1;
  for (let k = 0; k < levels; k++) {
    const at4 = base + 4 * k, level = shape[Math.min(k, shape.length - 1)];
    if (cut >= 0) { rings.copyWithin(at4, cut, cut + 4); continue; }
    const left = Math.max(now - level[4], 0), makes = isAirborne(drone, left) && isThere(drone, left);
    locate(drone, left, spot);
    const ends = drone.ends.length ? stepped(drone.ends, left)[1] : null;
    let x = spot[0] + level[2], y = spot[1] + level[3], z = spot[2] - level[0], r = makes ? level[1] : 0;
    const stop = ends === null ? low[2] : ends;
    if (z < stop && k > 0) {
      const b = at4 - 4, above = rings[b + 2], part = above > z + 1e-9 ? Math.max(0, Math.min(1, (above - stop) / (above - z))) : 1;
      x = rings[b] + part * (x - rings[b]); y = rings[b + 1] + part * (y - rings[b + 1]); z = stop; r = rings[b + 3] + part * (r - rings[b + 3]);
      cut = at4;
    }
    rings[at4] = x; rings[at4 + 1] = y; rings[at4 + 2] = z; rings[at4 + 3] = r;
  }
};

// Trails: what was flown in the last seconds, fading; the whole path of the chosen drone with arrows.
const TRAIL_S = 5, PARTS = many ? 0 : 20;
const trailPlaces = new Float32Array(fleet * PARTS * 6), trailTones = new Float32Array(fleet * PARTS * 8);
const trailGeometry = new T.BufferGeometry();
trailGeometry.setAttribute('position', new T.BufferAttribute(trailPlaces, 3));
trailGeometry.setAttribute('color', new T.BufferAttribute(trailTones, 4));
const trails = new T.LineSegments(trailGeometry, new T.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
trails.frustumCulled = false;
if (PARTS) scene.add(trails);
const pathLook = flat(0);
let path = null;
const drawPath = drone => {
  if (path) { scene.remove(path); path.geometry.dispose(); path = null; }
  if (!drone) return;
  const places = [], from = new Float64Array(6), to = new Float64Array(6);
  const last = drone.t[drone.t.length - 1], parts = Math.min(2000, Math.max(40, Math.ceil(last * 8)));
  let flown = 0;
  const gap = Math.max(1.2, Math.max(...size) / 18);
  locate(drone, 0, from);
  for (let k = 1; k <= parts; k++) {
    locate(drone, last * k / parts, to);
    const d = [to[0] - from[0], to[1] - from[1], to[2] - from[2]], length = Math.hypot(...d);
    if (length > 1e-6) {
      places.push(from[0], from[1], from[2], to[0], to[1], to[2]);
      flown += length;
      if (flown > gap) {
        // An arrow head: two strokes back and aside.
        flown = 0;
        const [a, b, c] = d.map(it => it / length), flat2 = Math.hypot(a, b) || 1;
        const aside = Math.hypot(a, b) > 1e-6 ? [-b / flat2, a / flat2, 0] : [1, 0, 0], h = LEAST_M * 0.8;
        for (const sign of [1, -1]) places.push(to[0], to[1], to[2], to[0] - h * a + sign * 0.5 * h * aside[0], to[1] - h * b + sign * 0.5 * h * aside[1], to[2] - h * c);
      }
    }
    from.set(to);
  }
  path = lines(places, pathLook);
};

// What was flown: darker craft beside the plan's, a line from where the plan has each, the last
// seconds of each, and the whole path of the chosen one.
const GONE = -32768;
let flying = null;
const flownPaths = (data.flown ? data.flown.flights : []).map(flight => {
  const of = new Map();
  for (const [index, text] of Object.entries(flight)) of.set(Number(index), new Int16Array(decode64(text).buffer));
  return of;
});
const ghostLook = new T.MeshLambertMaterial({}), ghosts = new T.InstancedMesh(craft(), ghostLook, Math.max(fleet, 1));
ghosts.frustumCulled = false; ghosts.count = 0;
if (data.flown) scene.add(ghosts);
const flownLook = flat(0), flownPlaces = new Float32Array(data.flown ? fleet * (PARTS + 1) * 6 : 0), flownGeometry = new T.BufferGeometry();
flownGeometry.setAttribute('position', new T.BufferAttribute(flownPlaces, 3));
const flownLines = new T.LineSegments(flownGeometry, flownLook);
flownLines.frustumCulled = false;
if (data.flown) scene.add(flownLines);
// Where a drone flew; false: it did not, or that is not in the page.
const locateFlown = (drone, at, out) => {
  const off = flying && flying.get(drone.index);
  if (!off) return false;
  const last = off.length / 3 - 1, k = Math.max(0, Math.min((at - data.flown.from_s) / data.flown.step_s, last));
  const a = Math.floor(k), b = Math.min(a + 1, last), part = k - a;
  if (off[3 * a] === GONE || off[3 * b] === GONE) return false;
  locate(drone, at, out);
  for (let axis = 0; axis < 3; axis++) out[axis] += (off[3 * a + axis] + part * (off[3 * b + axis] - off[3 * a + axis])) * 1e-3;
  return true;
};
let flownPath = null;
const drawFlownPath = drone => {
  if (flownPath) { scene.remove(flownPath); flownPath.geometry.dispose(); flownPath = null; }
  const off = drone && flying && flying.get(drone.index);
  if (!off) return;
  const places = [], from = new Float64Array(6), to = new Float64Array(6);
  let open = false;
  for (let k = 0; k < off.length / 3; k++) {
    const at = data.flown.from_s + k * data.flown.step_s, is = at >= 0 && locateFlown(drone, at, to);
    if (is && open) places.push(from[0], from[1], from[2], to[0], to[1], to[2]);
    open = is;
    from.set(to);
  }
  flownPath = lines(places, flownLook);
};
const drawFlown = () => {
  let count = 0, used = 0;
  if (flying) for (const drone of data.drones) {
    if (!isThere(drone, now) || !locateFlown(drone, now, spot)) continue;
    const r = Math.max(drone.body_radius_m, LEAST_M) * 0.7, [x, y, z] = spot;
    ghosts.setMatrixAt(count++, matrix.makeScale(r, r, r).setPosition(x, y, z));
    locate(drone, now, spot);
    flownPlaces.set([spot[0], spot[1], spot[2], x, y, z], 6 * used++);
    let before = [x, y, z];
    for (let part = 1; part <= PARTS; part++) {
      const at = now - TRAIL_S * part / PARTS;
      if (at < 0 || !locateFlown(drone, at, spot)) break;
      flownPlaces.set([...before, spot[0], spot[1], spot[2]], 6 * used++);
      before = [spot[0], spot[1], spot[2]];
    }
  }
  ghosts.count = count; ghosts.instanceMatrix.needsUpdate = true;
  flownGeometry.setDrawRange(0, 2 * used); flownGeometry.attributes.position.needsUpdate = true;
};

// Colours by the air met over the limit: dark to light would hide on one of both papers, so blue,
// amber, vermilion (Okabe and Ito: told apart with any common colour vision).
const tone = new T.Color(), CALM = new T.Color(0x3b76af), SOME = new T.Color(0xe8a33d), FULL = new T.Color(0xd55e00), GREY = new T.Color(0x8a949e), PINK = new T.Color(0xcc79a7);
const toneOf = (drone, now) => {
  if (drone.unplanned) return tone.copy(PINK);
  if (!isAirborne(drone, now)) return tone.copy(GREY);
  const ratio = airAt(drone, now) / Math.max(limitMps(drone, now), 1e-6);
  return ratio < 0.5 ? tone.copy(CALM).lerp(SOME, Math.max(0, ratio * 2)) : tone.copy(SOME).lerp(FULL, Math.min(1, ratio * 2 - 1));
};

// State.
let now = 0, playing = false, chosen = null, follow = false, showNames = fleet <= 16 && innerWidth > 720, showWakes = true, dirty = true, started = 0;
const meetsAt = (drone, at) => drone.meets.filter(([from, until]) => from <= at + data.step_s && at <= until + data.step_s);
const update = () => {
  const sources = new Set(chosen ? meetsAt(chosen, now).map(it => it[2]) : []);
  for (const drone of data.drones) {
    const k = drone.index;
    locate(drone, now, spot);
    const r = isThere(drone, now) ? Math.max(drone.body_radius_m, LEAST_M) : 0;
    matrix.makeScale(r, r, r).setPosition(spot[0], spot[1], spot[2]);
    drones.setMatrixAt(k, matrix);
    drones.setColorAt(k, toneOf(drone, now));
    tints[k] = sources.has(k) ? 1 : 0;
    if (PARTS) {
      const ink = trails.userData.ink;
      for (let part = 0; part < PARTS; part++) for (const endPoint of [0, 1]) {
        const age = TRAIL_S * (part + endPoint) / PARTS;
        locate(drone, Math.max(now - age, 0), spot);
        const i = (k * PARTS + part) * 2 + endPoint;
        trailPlaces.set([spot[0], spot[1], spot[2]], 3 * i);
        trailTones.set([ink.r, ink.g, ink.b, r ? 0.8 * (1 - age / TRAIL_S) : 0], 4 * i);
      }
    }
    if (showWakes) hang(drone, now);
  }
  if (PARTS) { trailGeometry.attributes.position.needsUpdate = true; trailGeometry.attributes.color.needsUpdate = true; }
  drones.instanceMatrix.needsUpdate = true;
  if (drones.instanceColor) drones.instanceColor.needsUpdate = true;
  if (data.flown) drawFlown();
  // Picking would keep the sphere of the first frame.
  drones.boundingSphere = null;
  ringTexture.needsUpdate = true; tintAttribute.needsUpdate = true;
  wakes.visible = showWakes;
  halo.visible = !!chosen && isThere(chosen, now);
  if (chosen) {
    locate(chosen, now, spot);
    if (follow) { const d = new T.Vector3(spot[0], spot[1], spot[2]).sub(controls.target); controls.target.add(d); camera.position.add(d); }
    const r = Math.max(chosen.body_radius_m, LEAST_M);
    halo.scale.set(r, r, r);
    halo.position.set(spot[0], spot[1], spot[2]);
  }
};
const project = at => {
  const point = new T.Vector3(at[0], at[1], at[2]).project(camera), box = $('view').getBoundingClientRect();
  return { x: box.left + (point.x + 1) / 2 * box.width, y: box.top + (1 - point.y) / 2 * box.height, behind: point.z > 1 };
};
const label = () => {
  const box = $('labels'), wanted = [], origin = $('view').getBoundingClientRect();
  for (const zone of data.zones) wanted.push([zone.name + (zone.keep_out ? ': no body may enter' : ''), [(zone.min_m[0] + zone.max_m[0]) / 2, (zone.min_m[1] + zone.max_m[1]) / 2, zone.max_m[2]], 'zone']);
  const sources = chosen ? meetsAt(chosen, now).map(it => data.drones[it[2]]) : [];
  for (const drone of data.drones) if (isThere(drone, now) && (drone === chosen || sources.includes(drone) || (showNames && fleet <= MANY))) {
    locate(drone, now, spot);
    wanted.push([drone.name, [spot[0], spot[1], spot[2] + LEAST_M], drone === chosen ? 'chosen' : '']);
  }
  while (box.children.length < wanted.length) box.append(document.createElement('span'));
  while (box.children.length > wanted.length) box.lastChild.remove();
  wanted.forEach(([text, at, kind], k) => {
    const span = box.children[k], there = project(at);
    if (span.textContent !== text) span.textContent = text;
    span.className = kind;
    const beside = there.x - origin.left + 6, left = beside < origin.width ? Math.min(beside, origin.width - span.offsetWidth) : beside;
    span.style.transform = `translate(${left.toFixed(1)}px,${(there.y - origin.top - 18).toFixed(1)}px)`;
    span.hidden = there.behind;
  });
};

// The timeline: a row a drone.
const timeline = $('timeline'), ROW = many ? 2 : fleet > 40 ? 8 : 13, LEFT = many ? 4 : 92;
const across = (at, width) => LEFT + (width - LEFT - 6) * at / end;
let backdrop = null;
const sheet = (canvas, width, height) => {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext('2d');
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return pen;
};
const drawRows = () => {
  const width = $('lines').clientWidth, height = Math.max(fleet * ROW + 2, 10);
  timeline.style.height = height + 'px';
  const pen = sheet(timeline, width, height), colour = Object.fromEntries(['fly', 'wait', 'dwell', 'ground', 'worst', 'ink', 'soft'].map(it => [it, css('--' + it)]));
  pen.font = '11px Helvetica,Arial,DejaVu Sans,sans-serif'; pen.textBaseline = 'middle';
  for (const drone of data.drones) {
    const y = drone.index * ROW + 1, h = Math.max(ROW - 3, 1.4);
    const bar = (from, until, fill) => { pen.fillStyle = fill; pen.fillRect(across(from, width), y, Math.max(across(until, width) - across(from, width), 0.5), h); };
    const [from, until] = drone.airborne_s, gone = drone.leaves ? drone.t[drone.t.length - 1] : end;
    bar(drone.enters_s || 0, gone, colour.ground);
    const top = Math.min(until === null ? gone : until, gone);
    if (top > from) { bar(from, top, colour.fly); if (drone.arrives_s < top && !drone.leaves) { pen.globalAlpha = 0.45; pen.fillStyle = css('--card'); pen.fillRect(across(drone.arrives_s, width), y, across(top, width) - across(drone.arrives_s, width), h); pen.globalAlpha = 1; } }
    for (const [a, b, what] of drone.stops) bar(a, b, what === 'wait' ? colour.wait : colour.dwell);
    if (!many) for (const [a, b, , most] of drone.meets) { pen.fillStyle = colour.worst; pen.globalAlpha = Math.min(1, 0.25 + most / Math.max(limitMps(drone, a), 0.01)); pen.fillRect(across(a, width), y + h - 2, Math.max(across(b, width) - across(a, width), 1), 2); pen.globalAlpha = 1; }
    if (!many && ROW > 9) { pen.fillStyle = drone === chosen ? colour.worst : colour.soft; pen.textAlign = 'right'; pen.fillText(drone.name.length > 14 ? drone.name.slice(0, 13) + '\u2026' : drone.name, LEFT - 6, y + h / 2); }
    if (drone === chosen) { pen.strokeStyle = colour.worst; pen.lineWidth = 1.2; pen.strokeRect(across(0, width) - 0.5, y - 0.5, width - LEFT - 5, h + 1); }
  }
  backdrop = document.createElement('canvas');
  backdrop.width = timeline.width; backdrop.height = timeline.height;
  if (timeline.width && timeline.height) backdrop.getContext('2d').drawImage(timeline, 0, 0);
};
const drawNow = () => {
  const pen = timeline.getContext('2d');
  if (!backdrop || !backdrop.width) return;
  pen.save(); pen.setTransform(1, 0, 0, 1, 0, 0); pen.clearRect(0, 0, timeline.width, timeline.height); pen.drawImage(backdrop, 0, 0); pen.restore();
  const x = across(now, $('lines').clientWidth);
  pen.fillStyle = css('--ink');
  pen.fillRect(x - 0.75, 0, 1.5, timeline.clientHeight);
};

// The panel of the chosen drone.
const number = (value, digits = 1) => value.toFixed(digits);
const build = () => {
  const panel = $('panel');
  panel.hidden = !chosen;
  panel.replaceChildren();
  if (!chosen) return;
  const add = (tag, text, into = panel) => { const it = document.createElement(tag); if (text !== undefined) it.textContent = text; into.append(it); return it; };
  const head = add('h2', chosen.name), close = add('button', '\u00d7', head);
  close.title = 'None (esc)'; close.onclick = () => pick(null);
  const list = add('dl');
  const row = (name, id) => { add('dt', name, list); const it = add('dd', '', list); it.id = id; return it; };
  row('airframe').textContent = chosen.airframe;
  row('now', 'doing'); row('air', 'air'); row('altitude', 'altitude'); row('speed', 'speed');
  row('arrives').textContent = chosen.unplanned ? 'stays' : `${number(chosen.arrives_s)} s, waits ${number(chosen.waits_s)} s`;
  row('worst air').textContent = chosen.worst_air_mps >= 0.05 ? `${number(chosen.worst_air_mps)} of ${number(limitMps(chosen, chosen.worst_air_at_s ?? 0))} m/s` : 'none';
  row('extra energy').textContent = chosen.unplanned ? 'not planned' : '+' + number(chosen.extra_energy_percent) + ' %';
  row('may be late').textContent = chosen.may_be_late_s === null ? 'not asked' : chosen.may_be_late_s >= 3 ? '3 s or more' : number(chosen.may_be_late_s, 2) + ' s';
  row('plan\u2019s margins').textContent = `${number(data.margins.time_s, 2)} s, ${number(data.margins.tracking_m, 2)} m`;
  if (chosen.unplanned) { const it = add('p', 'Stays: ' + chosen.unplanned); it.className = 'over'; }
  for (const [id, name] of [['chart-air', 'air (m/s), its limit dashed'], ['chart-altitude', 'altitude (m)'], ['chart-speed', 'speed (m/s), its limit dashed']]) {
    add('h3', name);
    const canvas = add('canvas'); canvas.id = id;
    canvas.onclick = event => { const box = canvas.getBoundingClientRect(); seek((event.clientX - box.left - 30) / (box.width - 34) * end); };
  }
  const link = (other, into) => { const it = add('a', data.drones[other].name, into); it.tabIndex = 0; it.onclick = () => pick(data.drones[other]); return it; };
  const moment = (at, into) => { const it = add('a', number(at) + ' s', into); it.tabIndex = 0; it.onclick = () => seek(at); };
  const stops = chosen.stops.filter(it => it[2] === 'wait');
  if (stops.length) {
    add('h3', data.drones.length > 1 ? 'waits; had it gone on at once, it would have met' : 'waits');
    const ul = add('ul');
    for (const [from, until, , other, costs] of stops) { const li = add('li', '', ul); moment(from, li); li.append(` for ${number(until - from)} s, later by ${number(costs)} s: `); if (other === null) li.append('several wakes together, or others\u2019 plans: plan explain tries each'); else link(other, li); }
  }
  const rest = chosen.waits_s - stops.reduce((sum, it) => sum + it[4], 0);
  if (rest > 0.1 && !chosen.unplanned) add('p', `waits ${number(rest)} s ${stops.length ? 'more ' : ''}by flying slower, without a stop`);
  if (chosen.meets.length) {
    add('h3', 'wakes it meets');
    const ul = add('ul');
    for (const [from, until, other, most] of chosen.meets.slice(0, 60)) { const li = add('li', '', ul); moment(from, li); li.append(` to ${number(until)} s, ${number(most, 2)} m/s: `); link(other, li); }
  }
  if (data.flight) fromFlight(add);
};
// What `plan fly` found of it.
const fromFlight = add => {
  add('h3', 'flown');
  const ul = add('ul');
  for (const flight of data.flight.flights) {
    const found = flight.drones.find(it => it.name === chosen.name);
    if (!found) continue;
    const li = add('li', `${named(flight)}: alpha ${number(found.worst_alpha, 2)} of ${number(found.air_limit, 2)}, altitude off by ${number(100 * found.altitude_max_m, 0)} cm, tracking ${number(100 * found.tracking_max_m, 0)} cm`, ul);
    if (found.worst_alpha > found.air_limit) li.className = 'over';
  }
};
const traceOf = drone => data.flight && data.flight.worst.find(it => it.drone === drone.name);
const chart = (id, value, limit, flown) => {
  const canvas = $(id);
  if (!canvas) return;
  const width = canvas.clientWidth, height = 84, pen = sheet(canvas, width, height), points = 240;
  const values = Array.from({ length: points + 1 }, (_, k) => value(end * k / points));
  const limits = limit ? Array.from({ length: points + 1 }, (_, k) => limit(end * k / points)) : [];
  const top = Math.max(1e-3, ...values, ...limits, ...flown.flatMap(it => it.values.filter(v => v !== null))) * 1.1, bottom = Math.min(0, ...values);
  const x = at => 30 + (width - 34) * at / end, y = v => height - 12 - (height - 18) * (v - bottom) / (top - bottom);
  pen.font = '10px Helvetica,Arial,DejaVu Sans,sans-serif'; pen.fillStyle = css('--soft'); pen.textAlign = 'right';
  for (const v of [bottom, top / 1.1]) { pen.fillText(number(v), 26, y(v) + 3); pen.fillStyle = css('--faint'); pen.fillRect(30, y(v), width - 34, 1); pen.fillStyle = css('--soft'); }
  pen.fillText(number(end, 0) + ' s', width - 4, height - 2); pen.textAlign = 'left'; pen.fillText('0', 30, height - 2);
  const curve = (count, at, v, colour, wide, dash = []) => { pen.beginPath(); let open = false; for (let k = 0; k < count; k++) { const it = at(k) < 0 || at(k) > end * 1.000001 ? null : v(k); if (it === null) { open = false; continue; } open ? pen.lineTo(x(at(k)), y(it)) : pen.moveTo(x(at(k)), y(it)); open = true; } pen.setLineDash(dash); pen.strokeStyle = colour; pen.lineWidth = wide; pen.stroke(); pen.setLineDash([]); };
  const FLOWN = ['#882255', '#117733', '#999933', '#aa4499'];
  flown.forEach((it, k) => curve(it.values.length, i => it.from + i * it.step, i => it.values[i], FLOWN[k % FLOWN.length], 1));
  curve(points + 1, k => end * k / points, k => values[k], css('--air'), 1.6);
  curve(limits.length, k => end * k / points, k => limits[k], css('--worst'), 1, [4, 3]);
  pen.fillStyle = css('--ink'); pen.fillRect(x(now) - 0.5, 4, 1, height - 16);
};
const state = new Float64Array(6);
const speedAt = (drone, at) => { locate(drone, at, state); return Math.hypot(state[3], state[4], state[5]); };
const tell = () => {
  $('clock').textContent = `${number(now, 2)} / ${number(end, 1)} s`;
  if (document.activeElement !== $('time') || playing) $('time').value = now;
  $('time').value = now;
  if (!chosen) return;
  const air = airAt(chosen, now), stop = chosen.stops.find(([from, until]) => from <= now && now < until);
  const speed = speedAt(chosen, now);
  $('doing').textContent = !isThere(chosen, now) ? 'not there' : !isAirborne(chosen, now) ? 'on the ground' : stop ? (stop[2] === 'dwell' ? 'dwells' : stop[2] === 'stop' ? 'stops' : stop[3] === null ? 'waits' : 'waits for ' + data.drones[stop[3]].name) : speed > 1e-3 ? (Math.abs(state[5]) > 0.9 * speed ? (state[5] > 0 ? 'climbs' : 'descends') : 'flies') : 'hovers';
  const limit = limitMps(chosen, now);
  $('air').textContent = `${number(air, 2)} of ${number(limit, 2)} m/s`;
  $('air').className = air > limit * 1.01 ? 'over' : '';
  $('altitude').textContent = number(state[2], 2) + ' m';
  $('speed').textContent = `${number(speed, 2)} of ${number(chosen.max_speed_mps, 1)} m/s`;
  const trace = traceOf(chosen), none = [];
  const of = pickValue => trace ? trace.flights.map(it => ({ from: trace.from_s, step: trace.step_s, values: pickValue(it) })) : none;
  chart('chart-air', at => airAt(chosen, at), at => limitMps(chosen, at), of(it => it.alpha.map((v, k) => { if (v === null) return null; const [none, one] = alphaMps(chosen, trace.from_s + k * trace.step_s); return none + v * (one - none); })));
  chart('chart-altitude', at => locate(chosen, at, state)[2], null, of(it => it.altitude_error_m.map((v, k) => v === null ? null : v + locate(chosen, trace.from_s + k * trace.step_s, state)[2])));
  chart('chart-speed', at => speedAt(chosen, at), () => chosen.max_speed_mps, none);
};
const remember = () => { const part = `#t=${number(now, 2)}` + (chosen ? '&drone=' + encodeURIComponent(chosen.name) : ''); try { history.replaceState(null, '', part); } catch (_) { /* a page in a frame has no address */ } };
const seek = at => { now = Math.min(Math.max(Number.isFinite(at) ? at : 0, 0), end); dirty = true; if (!playing) remember(); };
// Brings the row of the chosen drone into sight.
const reveal = () => {
  if (!chosen) return;
  const box = $('lines'), top = chosen.index * ROW;
  if (top < box.scrollTop || top + ROW > box.scrollTop + box.clientHeight) box.scrollTop = top - (box.clientHeight - ROW) / 2;
};
const pick = drone => { chosen = drone || null; if (!chosen) follow = false; drawPath(chosen); drawFlownPath(chosen); build(); resize(); drawRows(); reveal(); dirty = true; if (!playing) remember(); };
const play = on => { playing = on; $('play').textContent = on ? 'pause' : 'play'; if (on && now >= end) now = 0; started = performance.now(); dirty = true; if (!on) remember(); };
const fit = () => {
  moved = false;
  controls.target.set(middle[0], middle[1], low[2] + size[2] * 0.3);
  const towards = new T.Vector3(-0.55, -1, 0.75).normalize();
  const bounds = [];
  for (let k = 0; k < 8; k++) bounds.push(new T.Vector3(k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]));
  // The nearest place from which every corner is in the frame, then the corners' middle moved to the
  // frame's, and again.
  const half = Math.tan(camera.fov * Math.PI / 360);
  let far = 0;
  for (let round = 0; round < 5; round++) {
    let near = 0.1;
    far = 20 * Math.max(...size);
    const places = () => { camera.lookAt(controls.target); camera.updateMatrixWorld(); return bounds.map(it => it.clone().project(camera)); };
    for (let k = 0; k < 40; k++) {
      const between = (near + far) / 2;
      camera.position.copy(controls.target).addScaledVector(towards, between);
      if (places().every(it => Math.abs(it.x) < 0.95 && Math.abs(it.y) < 0.93 && it.z < 1)) far = between; else near = between;
    }
    camera.position.copy(controls.target).addScaledVector(towards, far);
    const seen = places(), off = axis => (Math.min(...seen.map(it => it[axis])) + Math.max(...seen.map(it => it[axis]))) / 2;
    const right = new T.Vector3().setFromMatrixColumn(camera.matrixWorld, 0), up = new T.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
    if (round < 4) controls.target.addScaledVector(right, off('x') * far * half * camera.aspect).addScaledVector(up, off('y') * far * half);
  }
  camera.position.copy(controls.target).addScaledVector(towards, far);
  camera.near = Math.max(0.02, far / 500); camera.far = far * 20;
  camera.updateProjectionMatrix();
  controls.update();
  dirty = true;
};
const paint = () => {
  const dark = document.documentElement.classList.contains('dark');
  scene.background = new T.Color(dark ? 0x11171d : 0xf3f5f6);
  floorLook.color.set(dark ? 0x182029 : 0xffffff);
  gridLook.color.set(dark ? 0x26313c : 0xe3e7eb);
  edgeLook.color.set(dark ? 0x475563 : 0xa9b4bf);
  solidLook.color.set(dark ? 0x53606d : 0xc3cad2);
  solidEdgeLook.color.set(dark ? 0x8090a0 : 0x7b8794);
  zoneLook.color.set(0xe8a33d); zoneEdgeLook.color.set(dark ? 0xf0bb6a : 0x8a5a10);
  wakeLook.uniforms.plain.value.set(dark ? 0x6db3e8 : 0x2b7bba); wakeLook.uniforms.met.value.set(0xd55e00);
  wakeLook.uniforms.strength.value = many ? Math.max(0.35, 8 / Math.sqrt(fleet)) : 1;
  halo.material.color.set(dark ? 0xff7a8a : 0xb3243b); pathLook.color.set(dark ? 0xff7a8a : 0xb3243b);
  ghostLook.color.set(dark ? 0xe8b0d4 : 0x882255); flownLook.color.set(dark ? 0xe8b0d4 : 0x882255);
  trails.userData.ink = new T.Color(dark ? 0xc9d4de : 0x3a4652);
  drawRows();
  dirty = true;
};
// Whether the view is the reader's own: then a new size leaves it.
let moved = false;
let wide = 0, tall = 0;
const resize = () => {
  const box = $('stage').getBoundingClientRect();
  if (box.width === wide && box.height === tall) return;
  wide = box.width; tall = box.height;
  renderer.setSize(wide, tall, false);
  camera.aspect = wide / Math.max(tall, 1);
  camera.updateProjectionMatrix();
  if (!moved) fit();
  dirty = true;
};
const frame = time => {
  if (playing) {
    now += Math.min((time - started) / 1000, 0.5) * Number($('speed').value);
    started = time;
    if (now >= end) { now = end; play(false); }
    dirty = true;
  }
  if (dirty) {
    dirty = false;
    update();
    renderer.render(scene, camera);
    label(); drawNow(); tell();
  }
  requestAnimationFrame(frame);
};

// What is pressed and clicked.
const ray = new T.Raycaster();
const at = (x, y) => {
  const box = $('view').getBoundingClientRect();
  ray.setFromCamera(new T.Vector2((x - box.left) / box.width * 2 - 1, 1 - (y - box.top) / box.height * 2), camera);
  const hit = ray.intersectObject(drones, false)[0];
  if (hit) return data.drones[hit.instanceId];
  // Beside a small one: the nearest on the screen within a finger's half width.
  let best = null, least = 14;
  for (const drone of data.drones) if (isThere(drone, now)) {
    const there = project(locate(drone, now, spot)), d = Math.hypot(there.x - x, there.y - y);
    if (!there.behind && d < least) { least = d; best = drone; }
  }
  return best;
};
let down = null;
$('view').addEventListener('pointerdown', event => { down = [event.clientX, event.clientY]; });
$('view').addEventListener('pointerup', event => {
  if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5) pick(at(event.clientX, event.clientY));
  down = null;
});
controls.addEventListener('change', () => { dirty = true; });
controls.addEventListener('start', () => { moved = true; });
timeline.addEventListener('click', event => {
  const box = timeline.getBoundingClientRect(), row = Math.floor((event.clientY - box.top) / ROW);
  if (data.drones[row]) pick(data.drones[row]);
  if (event.clientX - box.left > LEFT) seek((event.clientX - box.left - LEFT) / (box.width - LEFT - 6) * end);
});
timeline.addEventListener('pointermove', event => {
  const drone = data.drones[Math.floor((event.clientY - timeline.getBoundingClientRect().top) / ROW)];
  timeline.title = drone ? drone.name : '';
});
$('time').max = end;
$('time').addEventListener('input', event => { play(false); seek(Number(event.target.value)); });
$('play').onclick = () => play(!playing);
const names = () => { showNames = !showNames; $('names').setAttribute('aria-pressed', showNames); dirty = true; };
const air = () => { showWakes = !showWakes; $('wakes').setAttribute('aria-pressed', showWakes); dirty = true; };
const dark = () => { document.documentElement.classList.toggle('dark'); paint(); };
const help = () => { $('keys').hidden = !$('keys').hidden; };
const named = flight => `${flight.controller}, ${flight.feed_forward === 'none' ? 'no' : flight.feed_forward} feed-forward, air at ${flight.convection}`;
const fly = which => { flying = flownPaths[which] || null; drawFlownPath(chosen); dirty = true; };
if (data.flown) {
  $('which').hidden = false;
  $('flight').append(new Option('not shown', -1), ...data.flight.flights.map((it, k) => new Option(named(it) + (flownPaths[k].size < fleet ? `, ${flownPaths[k].size} drones` : ''), k)));
  $('flight').onchange = event => fly(Number(event.target.value));
  $('flight').value = 0; fly(0);
}
const nextFlight = () => { const it = $('flight'); if (!it.options.length) return; it.selectedIndex = (it.selectedIndex + 1) % it.options.length; fly(Number(it.value)); };
$('names').onclick = names; $('wakes').onclick = air; $('home').onclick = fit; $('theme').onclick = dark; $('help').onclick = help;
const turn = by => pick(data.drones[((chosen ? chosen.index : by > 0 ? -1 : 0) + by + fleet) % fleet]);
const faster = by => { const it = $('speed'); it.selectedIndex = Math.min(Math.max(it.selectedIndex + by, 0), it.options.length - 1); };
const KEYS = {
  ' ': () => play(!playing), ArrowLeft: () => seek(now - 1), ArrowRight: () => seek(now + 1), ',': () => seek(now - data.step_s), '.': () => seek(now + data.step_s),
  Home: () => seek(0), End: () => seek(end), '+': () => faster(1), '-': () => faster(-1), j: () => turn(1), k: () => turn(-1), f: () => { follow = !follow && !!chosen; dirty = true; },
  n: names, w: air, g: nextFlight, 0: fit, d: dark, '?': help, Escape: () => pick(null),
};
addEventListener('keydown', event => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'SELECT') return;
  const action = KEYS[event.key];
  if (!action || (event.key === ' ' && event.target.tagName === 'BUTTON')) return;
  event.preventDefault();
  action();
});
const fromAddress = () => {
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.has('drone')) pick(data.drones.find(it => it.name === asked.get('drone')));
  if (asked.has('t')) seek(Number(asked.get('t')));
};
addEventListener('hashchange', fromAddress);

// Begin.
document.title = $('title').textContent = data.scenario || 'plan';
$('facts').title = data.convection ? `The plan holds for air of every speed in its range; wakes and curves show that of ${data.convection} of the centreline's.` : 'Wakes are quasi-static: they follow their drones without delay.';
const failed = data.violation_count;
$('status').textContent = failed ? `${data.status}: ${failed} violation${failed === 1 ? '' : 's'}` : data.status;
$('status').classList.toggle('bad', data.status !== 'safe');
$('facts').textContent = `${fleet} drones, ${size.map(it => Number(it.toFixed(1))).join(' \u00d7 ')} m, ${number(end)} s` + (data.convection ? ', advected wakes' : ', quasi-static wakes') + `, margins ${number(data.margins.time_s, 2)} s and ${number(data.margins.tracking_m, 2)} m`;
$('legend').innerHTML = '<i style="background:var(--fly)"></i>flies<i style="background:var(--wait)"></i>waits<i style="background:var(--dwell)"></i>' + (data.drones.some(it => it.stops.some(stop => stop[2] === 'stop')) ? 'stops' : 'dwells') + '<i style="background:var(--ground)"></i>on the ground<i style="background:color-mix(in srgb,var(--card) 45%,var(--fly))"></i>in the air when done' + (many ? '' : '<i style="background:var(--worst)"></i>in a wake') + (data.drones.some(it => it.unplanned) ? '<i style="background:#cc79a7"></i>not planned' : '') + '<br>air, as a share of its limit 0<b style="background:linear-gradient(90deg,#3b76af,#e8a33d,#d55e00)"></b>1';
$('names').setAttribute('aria-pressed', showNames);
if (matchMedia('(prefers-color-scheme: dark)').matches) document.documentElement.classList.add('dark');
paint();
resize();
new ResizeObserver(() => { resize(); drawRows(); dirty = true; }).observe($('stage'));
fromAddress();
update();
renderer.render(scene, camera);
label(); drawNow(); tell();
// For tests and for programs that embed the page.
window.leeward = {
  seek: value => { play(false); seek(value); update(); renderer.render(scene, camera); label(); drawNow(); tell(); return now; },
  pick: name => pick(data.drones.find(it => it.name === name)),
  chosen: () => chosen && chosen.name,
  position: name => Array.from(locate(data.drones.find(it => it.name === name), now, new Float64Array(6)).slice(0, 3)),
  project: name => project(locate(data.drones.find(it => it.name === name), now, spot)),
  flown: name => { const out = new Float64Array(6); return locateFlown(data.drones.find(it => it.name === name), now, out) ? Array.from(out.slice(0, 3)) : null; },
  air: name => airAt(data.drones.find(it => it.name === name), now),
  drones: () => data.drones.map(it => it.name),
  end: () => end,
  now: () => now,
  render: () => ({ calls: renderer.info.render.calls, triangles: renderer.info.render.triangles }),
  // Different colours in the middle of the picture.
  colours: () => {
    const gl = renderer.getContext(), w = Math.min(300, gl.drawingBufferWidth), h = Math.min(200, gl.drawingBufferHeight), bytes = new Uint8Array(w * h * 4), seen = new Set();
    gl.readPixels((gl.drawingBufferWidth - w) >> 1, (gl.drawingBufferHeight - h) >> 1, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    for (let k = 0; k < bytes.length; k += 4) seen.add(bytes[k] << 16 | bytes[k + 1] << 8 | bytes[k + 2]);
    return seen.size;
  },
};
document.documentElement.dataset.state = 'ready';
requestAnimationFrame(frame);
})();
