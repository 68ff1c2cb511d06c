// HTTP: details on request, and every change. Changes carry the token, which comes from the
// address's fragment (never sent to a server or kept in the history) or is typed in.

const KEY = 'pheromone.token';

class Api {
  constructor() {
    this.onToken = () => {};
    this.reason = '';   // why nothing can be changed, whatever the token
    const fragment = new URLSearchParams(location.hash.slice(1));
    const given = fragment.get('token');
    if (given) {
      sessionStorage.setItem(KEY, given);
      fragment.delete('token');   // the rest is what is shown (address.js)
      history.replaceState(null, '', location.pathname + location.search + (fragment.size ? `#${fragment}` : ''));
    }
  }

  get token() { return sessionStorage.getItem(KEY) ?? ''; }

  set token(token) {
    if (token) sessionStorage.setItem(KEY, token);
    else sessionStorage.removeItem(KEY);
    this.onToken();
  }

  /** Why nothing can be changed now; empty: it can. */
  get refusal() { return this.reason || (this.token ? '' : 'needs the token: "Unlock" above'); }

  set refusal(reason) {
    this.reason = reason;
    this.onToken();
  }

  get(path) { return this.ask(path, {cache: 'no-store'}); }

  async post(path, body) {
    try {
      return await this.ask(path, {
        method: 'POST',
        headers: {'Authorization': `Bearer ${this.token}`, 'Content-Type': 'application/json'},
        body: JSON.stringify(body),
      });
    } catch (error) {
      if (error.status === 401) this.token = '';
      throw error;
    }
  }

  /** Why the server does not take this token; empty: it does. */
  async whyNot(token) {
    try {
      await this.ask('unlock', {method: 'POST', headers: {'Authorization': `Bearer ${token}`, 'Content-Type': 'application/json'}, body: '{}'});
    } catch (error) {
      return error.status === 401 ? 'This is not the server’s token.' : error.message;
    }
    return '';
  }

  async ask(path, options) {
    let response;
    try {
      response = await fetch(`/api/v1/${path}`, {...options, signal: AbortSignal.timeout(10000)});
    } catch {
      throw new Error('the server does not answer');
    }
    const answer = await response.json().catch(() => null);
    if (response.ok && answer !== null) return answer;
    const problem = answer?.error ?? {};
    const text = [problem.what || `status ${response.status}`,
                  problem.where ? `(${problem.where})` : '',
                  problem.expected ? `– expected ${problem.expected}` : ''];
    const error = new Error(text.filter((it) => it).join(' '));
    error.status = response.status;
    throw error;
  }
}

export const api = new Api();
