// What every reader of this folder that runs in Node shares; see read_files.py.

import { readFileSync, writeFileSync } from 'node:fs';

// Three.js was made for browsers.
globalThis.self ??= globalThis;

export async function tell(program, version, read) {
  const [out, ...paths] = process.argv.slice(2);
  const files = {};
  for (const path of paths) {
    try {
      files[path] = await read(path, readFileSync(path));
    } catch (error) {
      files[path] = { error: String(error?.stack ?? error) };
    }
  }
  writeFileSync(out, JSON.stringify({ program, version, files }));
}

export function versionOf(name) {
  return JSON.parse(readFileSync(new URL(`../node_modules/${name}/package.json`, import.meta.url))).version;
}
