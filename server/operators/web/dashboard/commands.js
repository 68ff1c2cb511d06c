// Commands to robots. The server replaces one that its robot has not yet acknowledged by the next one,
// so the next one waits here until then: "follow" and then "resume" are both obeyed. Halts do not wait.
import {api} from './api.js';
import {store} from './store.js';
import {toast} from './dom.js';

const PATIENCE_MS = 15000;   // later, what waits would come as a surprise

class Commands {
  constructor() {
    this.lines = new Map();   // robot -> {before: number of the command before, waiting: [], until}
  }

  send(key, command, args = []) {
    if (command === 'halt') this.forget(key);
    const last = store.robots.get(key)?.last_command;
    if (command === 'halt' || (!this.lines.has(key) && last?.outcome !== 'pending')) {
      this.post(key, command, args, []);
      return;
    }
    if (!this.lines.has(key)) this.lines.set(key, {before: undefined, command: last.command, waiting: []});
    const line = this.lines.get(key);
    line.waiting.push({command, args});
    line.until = performance.now() + PATIENCE_MS;
  }

  /** What waits is not sent: for this robot, or for all. */
  forget(key) {
    if (key === undefined) this.lines.clear();
    else this.lines.delete(key);
  }

  async post(key, command, args, waiting) {
    const robot = store.robots.get(key);
    if (!robot) return;
    const line = {before: robot.last_command?.seq, command, waiting, until: performance.now() + PATIENCE_MS};
    this.lines.set(key, line);
    try {
      await api.post('command', {link: robot.link, id: robot.id, command, arguments: args});
      toast(`Robot ${robot.id}: ${command} sent`);
    } catch (error) {
      toast(`Robot ${robot.id}: ${error.message}`, true);
      if (this.lines.get(key) === line) this.drop(key, `${command} failed`);
    }
  }

  /** To be called with each message of robots. */
  look() {
    for (const [key, line] of this.lines) {
      const last = store.robots.get(key)?.last_command;
      // With the number before, the message is older than the command.
      const outcome = last && last.seq !== line.before ? last.outcome : 'pending';
      if (outcome === 'accepted') {
        const next = line.waiting.shift();
        if (next) this.post(key, next.command, next.args, line.waiting);
        else this.lines.delete(key);
      } else if (outcome !== 'pending') {
        this.drop(key, `${last.command} was not obeyed`);
      } else if (performance.now() > line.until) {
        this.drop(key, `${line.command} is not acknowledged`);
      }
    }
  }

  drop(key, why) {
    const {waiting} = this.lines.get(key);
    this.lines.delete(key);
    if (waiting.length) toast(`${key}: ${waiting.map((it) => it.command).join(', ')} not sent: ${why}`, true);
  }
}

export const commands = new Commands();
