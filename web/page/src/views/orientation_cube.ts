// A cube in the corner that shows how the patient lies. A click on a face looks from there.
import * as THREE from 'three';

const SIZE = 84, MARGIN = 10; // pixels
const FACES = ['L', 'R', 'P', 'A', 'S', 'I']; // three.js' order: +x, -x, +y, -y, +z, -z

function letter(text: string): THREE.Texture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 128;
  const context = canvas.getContext('2d')!;
  context.fillStyle = '#46566d';
  context.fillRect(0, 0, 128, 128);
  context.strokeStyle = '#2c3746';
  context.lineWidth = 6;
  context.strokeRect(3, 3, 122, 122);
  context.fillStyle = '#ffffff';
  context.font = '600 82px system-ui, sans-serif';
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillText(text, 64, 70);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  // Upright as seen from outside with superior up; the box has y up on its sides in other ways.
  texture.center.set(0.5, 0.5);
  texture.rotation = { L: Math.PI / 2, R: -Math.PI / 2, P: Math.PI, A: 0, S: 0, I: Math.PI }[text]!;
  return texture;
}

export class OrientationCube {
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(24, 1, 0.1, 20);
  private readonly cube = new THREE.Mesh(new THREE.BoxGeometry(1, 1, 1),
    FACES.map((face) => new THREE.MeshBasicMaterial({ map: letter(face) })));

  constructor() {
    this.scene.add(this.cube);
    this.camera.up.set(0, 0, 1);
  }

  draw(renderer: THREE.WebGLRenderer, view: THREE.Camera, width: number, height: number): void {
    this.follow(view);
    renderer.setViewport(width - SIZE - MARGIN, MARGIN, SIZE, SIZE);
    renderer.render(this.scene, this.camera);
    renderer.setViewport(0, 0, width, height);
  }

  private follow(view: THREE.Camera): void {
    const back = new THREE.Vector3(0, 0, 1).applyQuaternion(view.quaternion);
    this.camera.position.copy(back).multiplyScalar(4.2);
    this.camera.quaternion.copy(view.quaternion);
    this.camera.updateMatrixWorld();
  }

  /** The patient direction of the face at a pixel, if the cube is there. */
  directionAt(x: number, y: number, width: number, height: number, view: THREE.Camera): string | undefined {
    const u = (x - (width - SIZE - MARGIN)) / SIZE, v = (y - (height - SIZE - MARGIN)) / SIZE;
    if (u < 0 || u > 1 || v < 0 || v > 1) return undefined;
    this.follow(view);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * u - 1, 1 - 2 * v), this.camera);
    const hit = ray.intersectObject(this.cube)[0];
    return hit?.face ? FACES[hit.face.materialIndex] : undefined;
  }
}
