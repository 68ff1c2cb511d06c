// A test in a browser, of steps that have names: the name of one that fails is printed, and the log of
// the server.
import {launch} from './browser.mjs';

let step = '';

export function begin(name) {
  step = name;
  console.log(`  ${name}`);
}

/** `test` is given the browser; it and the swarm end in any case. */
export async function run(swarm, test) {
  const browser = await launch();
  try {
    await test(browser);
    console.log('ok');
  } catch (error) {
    console.log(`failed: ${step}`);
    console.log(swarm.log().slice(-2000));
    throw error;
  } finally {
    await browser.close();
    await swarm.end();
  }
}
