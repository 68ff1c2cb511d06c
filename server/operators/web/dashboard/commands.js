// Commands to robots, and their goals; what became of them is told once, however many robots they are.
//
// The server replaces a command that its robot has not yet acknowledged by the next one, so the next
// one waits here until then: "follow" and then "resume" are both obeyed. Halts do not wait.
import {api} from './api.js';
import {store} from './store.js';
import {toast} from './dom.js';
import {metres} from './format.js';

const PATIENCE_MS = 15000;   // later, what waits would come as a surprise

const robotsOf = (keys) => [...keys].map((it) => store.robots.get(it)).filter((it) => it);
const nameOf = (robots) => (robots.length === 1 ? `Robot ${robots[0].id}` : `${robots.length} robots`);
const addressOf = ({link, id}) => ({link, id});

/** Calls `act` for each robot; it returns whether that is done now. */
async function tell(robots, done, act) {
  const problems = new Map();   // text -> robots
  const reached = [];
  await Promise.all(robots.map(async (robot) => {
    try {
      if (await act(robot)) reached.push(robot);
    } catch ({message}) {
      problems.set(message, [...(problems.get(message) ?? []), robot]);
    }
  }));
  if (reached.length) toast(`${reached.length < robots.length ? `${reached.length} of ` : ''}${nameOf(robots)}${done}`);
  for (const [message, those] of problems) toast(`Robot${those.length > 1 ? 's' : ''} ${those.map((it) => it.id).join(', ')}: ${message}`, true);
}

class Commands {
  constructor() {
    this.lines = new Map();   // robot -> {before: number of the command before, waiting: [], until}
  }

  send(keys, command, args = []) {
    return tell(robotsOf(keys), `: ${command} sent`, (robot) => this.sendOrWait(robot, command, args));
  }

  /** Each to this point; several to where they stand to each other, with their middle there. */
  goTo(keys, {x, y}) {
    const robots = robotsOf(keys);
    const placed = robots.filter((it) => it.pose);
    const middle = (axis) => placed.reduce((sum, {pose}) => sum + pose[axis], 0) / placed.length;
    const goal = (at, robot, axis) => Math.round((at + (robot.pose ? robot.pose[axis] - middle(axis) : 0)) * 1e6) / 1e6;
    return tell(robots, ` go${robots.length === 1 ? 'es' : ''} to ${metres(x)}, ${metres(y)}`, (robot) =>
      api.post('goto', {...addressOf(robot), x_m: goal(x, robot, 'x_m'), y_m: goal(y, robot, 'y_m')}));
  }

  cancelGoals(keys) {
    return tell(robotsOf(keys).filter((it) => it.goal), ': goal cancelled', (robot) => api.post('goto', {...addressOf(robot), cancel: true}));
  }

  // False: it waits for the robot's command before.
  async sendOrWait({key, last_command: last}, command, args) {
    if (command === 'halt') this.forget(key);
    if (command === 'halt' || (!this.lines.has(key) && last?.outcome !== 'pending')) return this.post(key, command, args, []);
    if (!this.lines.has(key)) this.lines.set(key, {before: undefined, command: last.command, waiting: []});
    const line = this.lines.get(key);
    line.waiting.push({command, args});
    line.until = performance.now() + PATIENCE_MS;
    return false;
  }

  /** What waits is not sent: for this robot, or for all. */
  forget(key) {
    if (key === undefined) this.lines.clear();
    else this.lines.delete(key);
  }

  async post(key, command, args, waiting) {
    const robot = store.robots.get(key);
    const line = {before: robot.last_command?.seq, command, waiting, until: performance.now() + PATIENCE_MS};
    this.lines.set(key, line);
    try {
      return await api.post('command', {...addressOf(robot), command, arguments: args});
    } catch (error) {
      if (this.lines.get(key) === line) this.drop(key, `${command} failed`);
      throw error;
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
        if (next) tell(robotsOf([key]), `: ${next.command} sent`, () => this.post(key, next.command, next.args, line.waiting));
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
