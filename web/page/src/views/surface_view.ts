// Draws the surface with three.js: only when something changed, and not while nothing can be seen.
import type { Mesh } from 'marrow-wasm';
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Vec3 } from '../scan/geometry';
import { length, sub, toPhysical, toIndexSpace, clampIndex } from '../scan/geometry';
import type { Store } from '../state';
import { distanceText, midpoint } from '../distances';
import { elementOf } from '../dom';
import { mark } from '../timing';
import { pickTriangle } from './ray_pick';
import { OrientationCube } from './orientation_cube';

/** Where the camera is, for each patient direction that it can look from (LPS). */
const DIRECTIONS: Readonly<Record<string, Vec3>> =
  { A: [0, -1, 0], P: [0, 1, 0], L: [1, 0, 0], R: [-1, 0, 0], S: [0, 0, 1], I: [0, 0, -1] };
const FIRST_DIRECTION: Vec3 = [0.62, -1, 0.28];
const FIELD_OF_VIEW = 28;

// As in glass, parts that face the camera are more transparent than the outline.
const GLASS = `
  if (opacity < 1.0) diffuseColor.a = mix(min(1.0, 3.0 * opacity), opacity, pow(abs(normalize(normal).z), 0.8));
  #include <opaque_fragment>`;

type Material = THREE.MeshStandardMaterial | THREE.MeshLambertMaterial; // the second is cheaper to draw by a processor

interface Shown { object: THREE.Mesh<THREE.BufferGeometry, Material>; points: Float32Array; triangles: Uint32Array; label?: number }

/** What a view shows in place of the surface, with the reason. */
export const cannotDraw = (reason: string): HTMLElement => elementOf('div', { class: 'missing' },
  elementOf('h2', {}, 'The surface cannot be drawn'), elementOf('p', {}, `${reason} Slices, numbers and export work without it.`));

export class SurfaceView {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 1, 10000);
  private readonly controls: OrbitControls;
  private readonly cube: OrientationCube;
  private readonly box = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xf0a830 }));
  private readonly rulers = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0x4fc3f7, depthTest: false }));
  private readonly ends = new THREE.Points(new THREE.BufferGeometry(),
    new THREE.PointsMaterial({ color: 0x4fc3f7, size: 9, sizeAttenuation: false, depthTest: false }));
  private readonly tags = document.createElement('div');
  private readonly materials: Material[] = []; // kept for the next surfaces, because each new one is compiled
  private shown: Shown[] = [];
  private preview: Shown | undefined; // drawn instead while the camera moves, where drawing is slow
  private centre = new THREE.Vector3();
  private radius = 100;
  private frame = 0;
  private lastFrame = 0;
  private frames: number[] = [];
  private orbiting = false;
  private isNew = false; // the surface was not drawn yet

  /** Whether a processor draws in place of a graphics card. */
  readonly software: boolean;
  /** @throws Error the browser has no WebGL 2 */
  constructor(private readonly element: HTMLElement, private readonly store: Store, private readonly moving: () => boolean) {
    this.software = drawsInSoftware();
    this.renderer = new THREE.WebGLRenderer({ antialias: !this.software, alpha: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.autoClear = false;
    element.prepend(this.renderer.domElement);
    this.renderer.domElement.setAttribute('aria-hidden', 'true');
    element.append(this.tags);
    this.tags.setAttribute('aria-hidden', 'true');

    this.camera.up.set(0, 0, 1);
    this.addLights();
    this.scene.add(this.camera, this.box, this.rulers, this.ends);
    this.rulers.renderOrder = this.ends.renderOrder = 2;
    for (const object of [this.box, this.rulers, this.ends]) object.frustumCulled = false;
    this.cube = new OrientationCube();

    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.rotateSpeed = 0.9;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.draw());
    this.controls.addEventListener('start', () => { this.orbiting = true; this.frames = []; });
    this.controls.addEventListener('end', () => { this.orbiting = false; this.draw(); });

    this.listenToPointer();
    this.listenToKeys();
    this.listenToLoss();
    new ResizeObserver(() => this.resize()).observe(element);
    store.on(['scan'], () => this.lookFrom());
    store.on(['surface'], () => this.updateSurface());
    store.on(['labelSurfaces'], () => this.updateLabels());
    store.on(['hidden'], () => this.draw());
    store.on(['colour', 'opacity'], () => this.updateLook());
    store.on(['crop', 'tool', 'scan'], () => this.updateBox());
    store.on(['distances', 'picked', 'scan'], () => this.updateRulers());
  }

  /** Whether frames take so long that previews are drawn while something moves. */
  get slow(): boolean { return this.software || (this.frames.length >= 4 && median(this.frames) > 70); }

  private get ratio(): number { return this.software ? 1 : Math.min(devicePixelRatio, 2); }

  // A key light at the upper left, a weak one from the other side, one from behind, all moving with the camera.
  private addLights(): void {
    const add = (colour: number, intensity: number, x: number, y: number, z: number) => {
      const light = new THREE.DirectionalLight(colour, intensity);
      light.position.set(x, y, z);
      this.camera.add(light, light.target);
      light.target.position.set(0, 0, -1);
    };
    add(0xfff3e2, 2.5, -1.2, 1.5, 1);
    add(0xd6e4ff, 0.6, 1.8, -0.2, 0.6);
    add(0xe8f0ff, 0.45, 0.3, 1, -2.4);
    const sky = new THREE.HemisphereLight(0xf4f7ff, 0x4a4540, 0.3);
    sky.position.set(0, 0, 1);
    this.scene.add(sky);
  }

  private material(): Material {
    const look = { side: THREE.DoubleSide };
    const material = this.software ? new THREE.MeshLambertMaterial(look) : new THREE.MeshStandardMaterial({ ...look, roughness: 0.55 });
    material.onBeforeCompile = (shader) => { shader.fragmentShader = shader.fragmentShader.replace('#include <opaque_fragment>', GLASS); };
    return material;
  }

  /** `i` is the number of the surface among those that are shown together. */
  private shownOf(i: number, { points, normals, triangles }: Mesh, colour: string): Shown {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
    if (normals.length > 0) geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    const material = (this.materials[i] ??= this.material());
    material.color.set(colour);
    if (material.flatShading !== (normals.length === 0)) material.needsUpdate = true;
    material.flatShading = normals.length === 0;
    const object = new THREE.Mesh(geometry, material);
    object.frustumCulled = false; // saves the bounding sphere, which would visit each point
    return { object, points, triangles };
  }

  private remove(shown: Shown): void {
    this.scene.remove(shown.object);
    shown.object.geometry.dispose();
  }

  private get all(): Shown[] { return this.preview ? [...this.shown, this.preview] : this.shown; }

  private updateSurface(): void {
    const { surface, colour } = this.store.state;
    const before = this.all;
    const shownOf = (mesh: Mesh) => before.find((s) => s.points === mesh.points) ?? this.shownOf(0, mesh, colour);
    this.shown = surface ? [shownOf(surface.mesh)] : [];
    this.preview = surface?.preview && shownOf(surface.preview);
    for (const old of before) if (!this.all.includes(old)) this.remove(old);
    for (const { object } of this.all) this.scene.add(object);
    this.isNew = true;
    this.updateLook();
  }

  private updateLabels(): void {
    const { labelSurfaces, asLabels } = this.store.state;
    if (!asLabels) return;
    this.shown.forEach((old) => this.remove(old));
    this.shown = labelSurfaces.map((s, i) =>
      ({ ...this.shownOf(i, s, `rgb(${s.colour.map((c) => Math.round(c * 255)).join(',')})`), label: s.label }));
    this.shown.forEach((s) => this.scene.add(s.object));
    this.updateLook();
  }

  /** Whether the label of a surface is hidden. */
  private hides({ label }: Shown): boolean { return label !== undefined && this.store.state.hidden.has(label); }

  private updateLook(): void {
    const { colour, opacity, asLabels } = this.store.state;
    for (const { object } of this.all) {
      const look = object.material;
      if (!asLabels) look.color.set(colour);
      // Translucent surfaces show only their front, as otherwise triangles behind would be drawn in any order.
      const side = opacity < 1 ? THREE.FrontSide : THREE.DoubleSide;
      if (look.transparent !== opacity < 1 || look.side !== side) look.needsUpdate = true;
      look.transparent = opacity < 1;
      look.opacity = opacity;
      look.side = side;
    }
    this.draw();
  }

  private updateBox(): void {
    const { crop, geometry, tool } = this.store.state;
    this.box.visible = geometry !== undefined && (crop !== undefined || tool === 'crop');
    if (geometry && this.box.visible) {
      const first = (crop?.first ?? [0, 0, 0]).map((v) => v - 0.5), last = (crop?.last ?? geometry.dims.map((n) => n - 1)).map((v) => v + 0.5);
      const corner = (bits: number) => toPhysical(geometry, [0, 1, 2].map((a) => (bits >> a & 1 ? last[a]! : first[a]!)) as Vec3);
      const lines: number[] = [];
      for (let bits = 0; bits < 8; ++bits)
        for (let a = 0; a < 3; ++a) if (!(bits >> a & 1)) lines.push(...corner(bits), ...corner(bits | 1 << a));
      setPositions(this.box.geometry, lines);
    }
    this.draw();
  }

  private updateRulers(): void {
    const { distances, picked } = this.store.state;
    const lines = distances.flatMap(({ from, to }) => [...from, ...to]);
    setPositions(this.rulers.geometry, lines);
    setPositions(this.ends.geometry, picked ? [...lines, ...picked] : lines);
    this.tags.replaceChildren(...distances.map((distance) => {
      const tag = document.createElement('span');
      tag.className = 'tag';
      tag.textContent = distanceText(distance);
      return tag;
    }));
    this.draw();
  }

  /** Looks from a patient direction, or as at the start, at the whole scan. */
  lookFrom(direction?: string): void {
    const { geometry: g } = this.store.state;
    if (!g) return;
    const middle = toPhysical(g, g.dims.map((n) => (n - 1) / 2) as Vec3);
    const corner = toPhysical(g, [0, 0, 0]), opposite = toPhysical(g, g.dims.map((n) => n - 1) as Vec3);
    this.centre.set(...middle);
    this.radius = Math.max(length(sub(opposite, corner)) / 2, 1e-3);
    const from = new THREE.Vector3(...(direction ? DIRECTIONS[direction]! : FIRST_DIRECTION)).normalize();
    // Straight from above or below, the orbit needs a hint which way is up.
    if (Math.abs(from.z) > 0.99) from.add(new THREE.Vector3(0, from.z > 0 ? 1e-4 : -1e-4, 0)).normalize();
    this.controls.target.copy(this.centre);
    const narrow = Math.min(1, this.camera.aspect);
    const distance = (0.80 * this.radius) / Math.tan((FIELD_OF_VIEW / 2 * Math.PI) / 180) / narrow;
    this.camera.position.copy(this.centre).addScaledVector(from, distance);
    this.controls.minDistance = this.radius / 100;
    this.controls.maxDistance = 20 * distance;
    this.controls.update();
    this.draw();
  }

  private resize(): void {
    const { clientWidth: w, clientHeight: h } = this.element;
    if (w === 0 || h === 0) return;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draws with the next frame of the screen. */
  draw(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame((time) => this.render(time));
  }

  private render(time: number): void {
    this.frame = 0;
    const { clientWidth: w, clientHeight: h } = this.element;
    if (w === 0 || h === 0) return;
    if (this.orbiting && time - this.lastFrame < 500) this.frames = [...this.frames.slice(-7), time - this.lastFrame];
    this.lastFrame = time;
    // A processor draws fewer pixels while something moves.
    const ratio = this.software && (this.orbiting || this.moving()) ? 0.5 : this.ratio;
    if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
    this.drawScene(this.orbiting && this.slow && this.preview !== undefined);
    this.renderer.clearDepth();
    this.cube.draw(this.renderer, this.camera, w, h);
    this.placeTags(w, h);
    if (this.isNew && this.shown.length > 0) mark('surface drawn');
    this.isNew = false;
  }

  private drawScene(coarse = false): void {
    for (const shown of this.shown) shown.object.visible = !coarse && !this.hides(shown);
    if (this.preview) this.preview.object.visible = coarse;
    const distance = this.camera.position.distanceTo(this.centre);
    this.camera.near = Math.max(distance - 1.5 * this.radius, distance / 1000, 1e-3);
    this.camera.far = distance + 1.5 * this.radius;
    this.camera.updateProjectionMatrix();
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
  }

  private placeTags(w: number, h: number): void {
    this.store.state.distances.forEach(({ from, to }, i) => {
      const at = new THREE.Vector3(...midpoint(from, to)).project(this.camera);
      const tag = this.tags.children[i] as HTMLElement;
      tag.style.left = `${((at.x + 1) / 2) * w}px`;
      tag.style.top = `${((1 - at.y) / 2) * h}px`;
    });
  }

  // A click puts the crosshair on the surface, or an end of a distance, or looks from a face of the cube.
  private listenToPointer(): void {
    const canvas = this.renderer.domElement;
    let down: { x: number; y: number } | undefined;
    canvas.addEventListener('pointerdown', (e) => { down = e.isPrimary && e.button === 0 ? { x: e.clientX, y: e.clientY } : undefined; });
    canvas.addEventListener('pointerup', (e) => {
      if (!down || Math.hypot(e.clientX - down.x, e.clientY - down.y) > 4) return;
      down = undefined;
      const r = canvas.getBoundingClientRect(), x = e.clientX - r.left, y = e.clientY - r.top;
      const direction = this.cube.directionAt(x, y, r.width, r.height, this.camera);
      if (direction) return this.lookFrom(direction);
      const position = this.positionAt((x / r.width) * 2 - 1, 1 - (y / r.height) * 2);
      if (position) this.click(position);
    });
  }

  private positionAt(x: number, y: number): Vec3 | undefined {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
    const origin = ray.ray.origin.toArray() as Vec3, direction = ray.ray.direction.toArray() as Vec3;
    let nearest = Infinity;
    for (const shown of this.shown)
      if (!this.hides(shown)) nearest = Math.min(nearest, pickTriangle(shown.points, shown.triangles, origin, direction));
    return Number.isFinite(nearest) ? ray.ray.at(nearest, new THREE.Vector3()).toArray() as Vec3 : undefined;
  }

  private click(position: Vec3): void {
    const { geometry, tool, picked, distances } = this.store.state;
    if (!geometry) return;
    if (tool !== 'distance') return this.store.set({ crosshair: clampIndex(geometry, toIndexSpace(geometry, position)) });
    if (!picked) return this.store.set({ picked: position });
    this.store.set({ picked: undefined, distances: [...distances, { from: picked, to: position }] });
  }

  private listenToKeys(): void {
    this.element.addEventListener('keydown', (e) => {
      if (e.ctrlKey || e.metaKey || e.altKey) return;
      const step = 0.12;
      const turns: Record<string, [number, number]> = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
      const turn = turns[e.key];
      if (turn) this.orbit(turn[0], turn[1]);
      else if (e.key === '+' || e.key === '=') this.zoom(1 / 1.15);
      else if (e.key === '-') this.zoom(1.15);
      else return;
      e.preventDefault();
    });
  }

  // The browser may take the graphics card away, as while the computer sleeps. The renderer then starts anew by itself, and
  // what it draws is still here.
  private listenToLoss(): void {
    const canvas = this.renderer.domElement, message = cannotDraw('The browser lost the graphics card. The surface is back once it has it again.');
    canvas.addEventListener('webglcontextlost', () => this.element.append(message));
    canvas.addEventListener('webglcontextrestored', () => {
      message.remove();
      this.resize();
    });
  }

  private orbit(around: number, over: number): void {
    const from = this.camera.position.clone().sub(this.controls.target);
    // Spherical's axis is y; here it is z.
    const s = new THREE.Spherical().setFromCartesianCoords(from.x, from.z, -from.y);
    s.theta += around;
    s.phi += over;
    s.makeSafe();
    const to = new THREE.Vector3().setFromSpherical(s);
    this.camera.position.copy(this.controls.target).add(new THREE.Vector3(to.x, -to.z, to.y));
    this.controls.update();
    this.draw();
  }

  private zoom(factor: number): void {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  /** A picture of the view without the cube, twice as large as on the screen, as PNG. */
  async picture(): Promise<Blob> {
    const { clientWidth: w, clientHeight: h } = this.element;
    if (w === 0 || h === 0) throw new Error('The picture is of the surface: show it first.');
    if (this.renderer.getContext().isContextLost()) throw new Error('The picture is of the surface, which cannot be drawn: the browser lost the graphics card.');
    this.renderer.setPixelRatio(2);
    this.renderer.setSize(w, h, false);
    this.drawScene();
    const canvas = document.createElement('canvas');
    canvas.width = 2 * w;
    canvas.height = 2 * h;
    const context = canvas.getContext('2d')!;
    const sky = context.createLinearGradient(0, 0, 0, 2 * h);
    const style = getComputedStyle(document.documentElement);
    sky.addColorStop(0, style.getPropertyValue('--sky-high'));
    sky.addColorStop(1, style.getPropertyValue('--sky-low'));
    context.fillStyle = sky;
    context.fillRect(0, 0, 2 * w, 2 * h);
    context.drawImage(this.renderer.domElement, 0, 0);
    this.drawTags(context);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(w, h, false);
    this.draw();
    return new Promise((resolve, reject) =>
      canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser cannot encode the picture.'))), 'image/png'));
  }

  private drawTags(context: CanvasRenderingContext2D): void {
    context.font = '600 26px system-ui, sans-serif';
    context.textAlign = 'center';
    for (const tag of this.tags.children as HTMLCollectionOf<HTMLElement>) {
      const x = 2 * parseFloat(tag.style.left), y = 2 * parseFloat(tag.style.top) - 30;
      const width = context.measureText(tag.textContent ?? '').width + 24;
      context.fillStyle = 'rgb(12 15 19 / 82%)';
      context.beginPath();
      context.roundRect(x - width / 2, y - 30, width, 42, 10);
      context.fill();
      context.fillStyle = '#eef4fa';
      context.fillText(tag.textContent ?? '', x, y);
    }
  }
}

// Whether a processor draws in place of a graphics card.
function drawsInSoftware(): boolean {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) throw new Error('WebGL 2 is missing');
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

function setPositions(geometry: THREE.BufferGeometry, positions: number[]): void {
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
}

const median = (values: number[]): number => [...values].sort((a, b) => a - b)[values.length >> 1]!;

