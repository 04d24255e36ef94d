// Exports a scene and has the Khronos validator read it: node validate_glb.mjs PROGRAM SCENE FILE
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const validator = createRequire(import.meta.url)('gltf-validator');
const [program, scene, file] = process.argv.slice(2);
execFileSync(program, ['export', scene, '--duration', '0.5', '--output', file]);
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
for (const message of report.issues.messages) console.log(message.code, message.pointer, message.message);
process.exit(report.issues.numErrors + report.issues.numWarnings > 0 ? 1 : 0);
