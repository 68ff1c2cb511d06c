// axe-core (npm, for tests alone) in a page: what people who cannot see it well, or have no mouse,
// could not use.
import {readFileSync} from 'node:fs';
import {check} from './swarm.mjs';

const source = readFileSync('node_modules/axe-core/axe.min.js', 'utf8');
const RULES = {'target-size': {enabled: true}, 'label-content-name-mismatch': {enabled: true}};

/** Fails with each element that breaks a rule, and why. */
export async function checkAccessible(page, what) {
  await page.emulateMedia({reducedMotion: 'reduce'});   // no colours on their way
  await page.evaluate(source);   // not as a script: the page's security policy forbids foreign ones
  const {violations, passes} = await page.evaluate((rules) => window.axe.run(document, {rules, resultTypes: ['violations']}), RULES);
  check(passes.length > 5, `${what}: only ${passes.length} rules of axe found something to check`);
  check(violations.length === 0, violations.flatMap(({id, nodes}) => nodes.map((it) =>
    `${what}: ${id}: ${it.target.join(' ')}: ${it.failureSummary.replace(/\s+/g, ' ')}`)).join('\n'));
  console.log(`    ${what}: no violation of ${passes.length} rules`);
}
