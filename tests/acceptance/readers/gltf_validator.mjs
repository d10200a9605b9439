// glTF by the validator of Khronos: what it has to say against a file.

import validator from 'gltf-validator';
import { tell } from './read_files.mjs';

await tell('glTF Validator', validator.version(), async (path, bytes) => {
  const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 0 });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  return {
    errors: numErrors, warnings: numWarnings, infos: numInfos, hints: numHints,
    messages: messages.map((one) => `${one.code} ${one.pointer ?? ''}: ${one.message}`),
    animations: report.info.animationCount, skinned: report.info.hasSkins, vertices: report.info.totalVertexCount,
  };
});
