// BVH by three.js: every joint in the world at every frame, in the file's own unit.

import { AnimationMixer, Group, Vector3 } from 'three';
import { BVHLoader } from 'three/examples/jsm/loaders/BVHLoader.js';
import { tell, versionOf } from './read_files.mjs';

await tell('three.js', versionOf('three'), async (path, bytes) => {
  const { skeleton, clip } = new BVHLoader().parse(bytes.toString('utf8'));
  const group = new Group();
  group.add(skeleton.bones[0]);
  const mixer = new AnimationMixer(skeleton.bones[0]);
  const action = mixer.clipAction(clip);
  action.clampWhenFinished = true;
  action.setLoop(2200, 1); // LoopOnce
  action.play();
  const times = [...clip.tracks[0].times];
  const point = new Vector3();
  // Ends of digits have no name of their own here: they are called after their joint.
  const labels = skeleton.bones.map((bone) => (bone.name === 'ENDSITE' ? `${bone.parent.name} end` : bone.name));
  const points = times.map((time_s) => {
    action.reset();
    mixer.setTime(time_s);
    group.updateMatrixWorld(true);
    return skeleton.bones.map((bone) => bone.getWorldPosition(point).toArray());
  });
  return { labels, points, frames: times.length, rate_hz: (times.length - 1) / (times.at(-1) - times[0]) };
});
