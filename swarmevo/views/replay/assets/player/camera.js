// SPDX-License-Identifier: BSD-3-Clause
// From where a scene is seen: from the south, from above, or near a robot; wheel and finger move it only where that is wanted.

const CAPTURED_SECONDS = 3; // for how long it is said how to zoom

/** The camera of meshcat's viewer. Its own frame has y upwards. `moved` is told whether it left where it was put. */
class Camera {
  constructor(viewer, holder, moved) {
    Object.assign(this, { viewer, holder, moved, isMoved: false, fromAbove: false, follow: null });
    viewer.camera.fov = 32;
    viewer.controls.maxPolarAngle = 1.5; // stay above the floor
    viewer.controls.addEventListener("start", () => this._move(true));
    this._zoom();
  }

  /** Zoom with the wheel, turn with a finger, after a click into the scene, until a click elsewhere; zoom with Ctrl, too.
   * Else the page scrolls. */
  _zoom() {
    const { holder, viewer } = this;
    const hint = element("p", "sw-hint", "", holder.parentElement);
    hint.hidden = true;
    const tell = (how) => {
      hint.textContent = how;
      hint.hidden = false;
      clearTimeout(this.hinted);
      this.hinted = setTimeout(() => (hint.hidden = true), 1000 * CAPTURED_SECONDS);
    };
    const enter = (inside) => {
      this.isEntered = inside;
      viewer.controls.enableZoom = inside;
      viewer.controls.domElement.style.touchAction = inside ? "none" : "pan-y";
      hint.hidden = true;
    };
    enter(false);
    this.outside = (event) => holder.contains(event.target) || enter(false);
    document.addEventListener("pointerdown", this.outside);
    holder.addEventListener("click", () => enter(true));
    const wheel = (event) => {
      viewer.controls.enableZoom = this.isEntered || event.ctrlKey;
      if (viewer.controls.enableZoom) hint.hidden = true;
      else tell("Click the scene, or hold Ctrl, to zoom with the wheel");
    };
    holder.addEventListener("wheel", wheel, { capture: true, passive: true });
    // Controls that are on take the finger, whatever touchAction says.
    const finger = ({ pointerType }) => (viewer.controls.enabled = this.isEntered || pointerType !== "touch");
    holder.addEventListener("pointerdown", finger, { capture: true });
    // The browser has taken the finger, to scroll.
    holder.addEventListener("pointercancel", () => this.isEntered || tell("Tap the scene to turn it and to zoom"));
  }

  /** Look at all of an arena, as near as it fits: from above, or from the south. */
  look({ bounds: [west, east, south, north] }) {
    const { THREE } = MeshCat;
    const { camera, controls } = this.viewer;
    const [middleX, middleY] = [(west + east) / 2, (south + north) / 2];
    const [halfX, halfY] = [((east - west) / 2) * 1.05, ((north - south) / 2) * 1.05];
    const corners = [-halfX, halfX].flatMap((x) => [-halfY, halfY].flatMap((y) => [0, 0.05].map((z) => new THREE.Vector3(middleX + x, z, -middleY - y))));
    const rise = this.fromAbove ? Math.PI / 2 - 1e-4 : camera.aspect < 1.1 ? 1.0 : 0.86;
    const direction = new THREE.Vector3(0, Math.sin(rise), Math.cos(rise));
    const target = new THREE.Vector3(middleX, 0, -middleY);
    let distance = 3 * Math.max(halfX, halfY);
    for (let turn = 0; turn < 12; turn++) {
      camera.position.copy(target).addScaledVector(direction, distance);
      camera.lookAt(target);
      const matrix = new THREE.Matrix4().compose(camera.position, camera.quaternion, new THREE.Vector3(1, 1, 1)).invert();
      const seen = corners.map((corner) => corner.clone().applyMatrix4(matrix).applyMatrix4(camera.projectionMatrix));
      const [low, high] = [Math.min(...seen.map((p) => p.y)), Math.max(...seen.map((p) => p.y))];
      const wide = Math.max(...seen.map((p) => Math.abs(p.x)));
      distance *= Math.max(wide / 0.95, (high - low) / 2 / 0.86);
      target.z -= ((low + high) / 2) * distance * Math.tan((camera.fov * Math.PI) / 360) * 0.8;
    }
    controls.target.copy(target);
    this.follow = null;
    this._move(false);
    this.viewer.set_dirty();
  }

  /** Come near a robot of a radius [m] and stay with it. */
  watch(robot, radius) {
    const { THREE } = MeshCat;
    const { camera, controls } = this.viewer;
    const direction = new THREE.Vector3().subVectors(camera.position, controls.target).normalize();
    camera.position.copy(controls.target).addScaledVector(direction, 16 * radius);
    this.follow = robot;
    this._move(true);
  }

  /** Go with what is followed. */
  go([x, y]) {
    const { THREE } = MeshCat;
    const { camera, controls } = this.viewer;
    const step = new THREE.Vector3(x, 0.02, -y).sub(controls.target);
    controls.target.add(step);
    camera.position.add(step);
  }

  /** Return how far round the camera stands [rad]; 0: in the south. */
  get turn() {
    return this.viewer.controls.getAzimuthalAngle();
  }

  /** Return where in the view a place is [pixels]; null: nowhere. */
  project(x, y, z) {
    const { THREE } = MeshCat;
    const place = new THREE.Vector3(x, z, -y).project(this.viewer.camera);
    if (Math.abs(place.z) > 1) return null;
    return [((place.x + 1) / 2) * this.holder.clientWidth, ((1 - place.y) / 2) * this.holder.clientHeight];
  }

  _move(moved) {
    this.isMoved = moved;
    this.moved(moved);
  }

  close() {
    document.removeEventListener("pointerdown", this.outside);
    clearTimeout(this.hinted);
  }
}
