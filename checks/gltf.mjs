// The Khronos validator on .glb files: node gltf.mjs PACKAGES FILE …
// Ends with a line of JSON: what was found, and every error and warning.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";
import path from "node:path";

const [packages, ...files] = process.argv.slice(2);
const validator = createRequire(path.resolve(packages, "node_modules", "x.js"))("gltf-validator");
const [problems, found] = [[], {}];
for (const file of files) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { uri: path.basename(file) });
  for (const message of issues.messages.filter(({ severity }) => severity < 2)) {
    problems.push(`${path.basename(file)}: ${message.code} ${message.message} ${message.pointer ?? ""}`);
  }
  found[path.basename(file)] = { vertices: info.totalVertexCount, triangles: info.totalTriangleCount };
}
console.log(JSON.stringify({ problems, ...found }));
