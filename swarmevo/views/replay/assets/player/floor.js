// SPDX-License-Identifier: BSD-3-Clause
// What is drawn on the floor: the robots' trails, and where movables stood at the start.

const TRAIL_SHADER = {
  vertexShader: `
    attribute float time; varying float when;
    void main() { when = time; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
  fragmentShader: `
    uniform float now; uniform float fade; uniform float strength; uniform vec3 colour; varying float when;
    void main() {
      float age = (now - when) / fade;
      if (age < 0.0 || age > 1.0) discard;
      gl_FragColor = vec4(colour, strength * pow(1.0 - age, 1.4));
    }`,
};

/** Return a robot's way as a ribbon on the floor, whose shader knows the time; `fade` is for how long it is seen [s]. */
function trail(track, robot, colour, strength, fade) {
  const { THREE } = MeshCat;
  const width = 0.09 * track.episode.robot.radius;
  const geometry = new THREE.BufferGeometry();
  const place = new Float32Array(6 * track.steps);
  const time = new Float32Array(2 * track.steps);
  const { position } = track.episode.unit;
  let [nx, ny] = [0, 0];
  for (let step = 0; step < track.steps; step++) {
    const here = 3 * (step * track.robots + robot);
    const ahead = 3 * (Math.min(step + 1, track.steps - 1) * track.robots + robot);
    const [dx, dy] = [track.pose[ahead] - track.pose[here], track.pose[ahead + 1] - track.pose[here + 1]];
    const length = Math.hypot(dx, dy);
    if (length > 8) [nx, ny] = [-dy / length, dx / length]; // else it stands, or trembles
    for (const side of [0, 1]) {
      const offset = (side ? -1 : 1) * width;
      place.set([track.pose[here] * position + offset * nx, track.pose[here + 1] * position + offset * ny, 0.0012 + 0.00002 * robot], 3 * (2 * step + side));
      time[2 * step + side] = step * track.episode.period;
    }
  }
  const index = [];
  for (let step = 0; step + 1 < track.steps; step++) {
    const a = 2 * step;
    index.push(a, a + 1, a + 2, a + 1, a + 3, a + 2);
  }
  geometry.setAttribute("position", new THREE.BufferAttribute(place, 3));
  geometry.setAttribute("time", new THREE.BufferAttribute(time, 1));
  geometry.setIndex(index);
  const material = new THREE.ShaderMaterial({
    ...TRAIL_SHADER,
    uniforms: { now: { value: 0 }, fade: { value: fade }, strength: { value: strength }, colour: { value: new THREE.Color(colour) } },
    transparent: true,
    depthWrite: false,
  });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

/** Return a dashed outline of a movable at a pose. */
function outline({ shape, size }, [x, y, heading]) {
  const { THREE } = MeshCat;
  const [w, h] = [size[0] / 2, size[1] / 2];
  const round = Array.from({ length: 41 }, (_, k) => [w * Math.cos((k * Math.PI) / 20), w * Math.sin((k * Math.PI) / 20)]);
  const rim = shape === "cylinder" ? round : [[w, h], [-w, h], [-w, -h], [w, -h], [w, h]];
  const points = rim.map(
    ([a, b]) => new THREE.Vector3(x + a * Math.cos(heading) - b * Math.sin(heading), y + a * Math.sin(heading) + b * Math.cos(heading), 0.0014),
  );
  const line = new THREE.Line(
    new THREE.BufferGeometry().setFromPoints(points),
    new THREE.LineDashedMaterial({ color: 0x9a7440, dashSize: 0.012, gapSize: 0.008 }),
  );
  line.computeLineDistances();
  return line;
}
