// The gateway's REST interface, and who we are to it.

let token = null;
try { token = sessionStorage.getItem('panelgate.token'); } catch { /* private window */ }

export const gateway = {configuration: null, role: 'viewer'};

/** An answer that is none: RFC 9457 with its members, or a gateway that does not answer. */
export class Refused extends Error {
    constructor(status, problem) {
        super(problem.detail ?? problem.title ?? String(status));
        this.status = status;
        this.problem = problem;
    }
}

/** What fetch() is to be told, with the token that we have. */
export function asUs(method = 'GET', headers = {}) {
    const options = {method, headers: {...headers}, cache: 'no-store'};
    if (token) options.headers.Authorization = `Bearer ${token}`;
    return options;
}

async function ask(method, path, body) {
    const options = asUs(method);
    if (body !== undefined) {
        options.body = JSON.stringify(body);
        options.headers['Content-Type'] = 'application/json';
    }
    let response;
    try {
        response = await fetch(path, options);
    } catch {
        throw new Refused(0, {title: 'unreachable'});
    }
    const given = response.headers.get('Content-Type') ?? '';
    const parsed = given.includes('json') ? await response.json() : {detail: await response.text()};
    if (!response.ok) throw new Refused(response.status, parsed);
    costs.set(parsed, response.headers.get('Panelgate-Transactions')?.split(',').map(transaction) ?? []);
    return parsed;
}

const costs = new WeakMap();

/** "floor1:17", or "17" where one line alone was asked. */
function transaction(text) {
    const [number, line] = text.trim().split(':').reverse();
    return [line ?? null, Number(number)];
}

/** The transactions that an answer has cost: [[line or null, id in its trace]]; [] where nobody tells. */
export const costOf = (answer) => costs.get(answer) ?? [];

export const get = (path) => ask('GET', path);
export const put = (path, body) => ask('PUT', path, body);
export const remove = (path) => ask('DELETE', path);
export const post = (path, body) => ask('POST', path, body);

/** /api/v1/... with each part encoded. */
export function path(...parts) {
    return '/api/v1/' + parts.map((part) => encodeURIComponent(part)).join('/');
}

/** Has the gateway this path? `pattern` as the configuration lists it: "GET /api/v1/relays". */
export function offers(pattern) {
    return gateway.configuration?.rest.some((route) => `${route.method} ${route.path}` === pattern) ?? false;
}

export const mayWrite = () => gateway.role === 'operator';

/** Learns what is configured, and what we may do. */
export async function introduce() {
    const {configuration, rest, role, version} = await get(path('configuration'));
    gateway.configuration = {...configuration, rest, version};
    gateway.role = role;
    gateway.build = offers('GET /api/v1/version') ? await get(path('version')) : null;
}

/** Takes another token, or none for ''; throws when the gateway does not know it. */
export async function useToken(given) {
    const before = token;
    token = given || null;
    try {
        await introduce();
    } catch (error) {
        token = before;
        throw error;
    }
    try {
        if (token) sessionStorage.setItem('panelgate.token', token);
        else sessionStorage.removeItem('panelgate.token');
    } catch { /* it is kept for as long as this page is */ }
}

/** Signs out; who may do nothing without a token is asked for one. */
export function forgetToken() {
    try { sessionStorage.removeItem('panelgate.token'); } catch { /* it was kept by this page alone */ }
    location.reload();
}

export const hasToken = () => token !== null;
