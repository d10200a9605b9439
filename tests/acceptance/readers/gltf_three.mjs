// glTF by three.js: every node in the world at every key, the skinned surfaces at some, and what the file says of itself.

import { AnimationMixer, Quaternion, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { tell, versionOf } from './read_files.mjs';

const SURFACES = 4; // instants at which surfaces are sampled

await tell('three.js', versionOf('three'), async (path, bytes) => {
  const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const gltf = await new GLTFLoader().parseAsync(data, '');
  const names = new Map(); // three.js takes colons out of names; the file has them
  for (const [object, at] of gltf.parser.associations)
    if (at?.nodes !== undefined && object.isObject3D) names.set(object, gltf.parser.json.nodes[at.nodes].name);
  const mixer = new AnimationMixer(gltf.scene);
  const times = [...new Set(gltf.animations.flatMap((clip) => clip.tracks.flatMap((track) => [...track.times])))];
  times.sort((a, b) => a - b);
  for (const clip of gltf.animations) {
    const action = mixer.clipAction(clip);
    action.clampWhenFinished = true;
    action.setLoop(2200, 1); // LoopOnce
    action.play();
  }
  const every = Math.max(1, Math.floor(times.length / SURFACES));
  const nodes = {}, turns = {}, surfaces = {}, surface_times_s = [];
  const point = new Vector3(), turn = new Quaternion();
  times.forEach((time_s, k) => {
    for (const clip of gltf.animations) mixer.clipAction(clip).reset();
    mixer.setTime(time_s);
    gltf.scene.updateMatrixWorld(true);
    for (const [object, name] of names) {
      (nodes[name] ??= []).push(object.getWorldPosition(point).toArray());
      (turns[name] ??= []).push(object.getWorldQuaternion(turn).toArray());
    }
    if (k % every) return;
    surface_times_s.push(time_s);
    gltf.scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.skeleton?.update();
      const place = mesh.geometry.attributes.position;
      const surface = [];
      for (let i = 0; i < place.count; i++) {
        mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld);
        surface.push(point.toArray());
      }
      (surfaces[names.get(mesh) ?? mesh.name] ??= []).push(surface);
    });
  });
  return {
    times_s: times, nodes, turns, surface_times_s, surfaces,
    animations: gltf.animations.map((clip) => [clip.name, clip.duration]),
    asset: gltf.asset, extras: gltf.scene.userData, animation_extras: gltf.animations.map((clip) => clip.userData),
    node_extras: Object.fromEntries([...names].map(([object, name]) => [name, object.userData])),
  };
});
