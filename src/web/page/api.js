// The gateway's REST interface, and who we are to it.
import {EventText} from './event_text.js';

let token = null;
try { token = sessionStorage.getItem('panelgate.token'); } catch { /* private window */ }

export const gateway = {configuration: null, role: 'viewer', rights: ['read'], text: {writable: false}};

/** An answer that is none: RFC 9457 with its members, or a gateway that does not answer. */
export class Refused extends Error {
    constructor(status, problem) {
        super(problem.detail ?? problem.title ?? String(status));
        this.status = status;
        this.problem = problem;
    }
}

const LIMIT = 3000;   // ms for what the gateway answers by itself
const LONG = 60000;   // ms for a file

/** Ms for what may ask a panel: the gateway says why nothing came before the page gives up. */
const patience = () => LIMIT + Math.max(0, ...gateway.configuration?.lines.map((line) => line.clients?.answered_within_ms ?? 0) ?? []);

/** What take() makes of an answer to a request with our token; all of it has come within `limit` ms. */
async function send(path, options, take, limit = LIMIT) {
    const headers = {...options.headers};
    if (token) headers.Authorization = `Bearer ${token}`;
    try {
        return await take(await fetch(path, {signal: AbortSignal.timeout(limit), ...options, headers, cache: 'no-store'}));
    } catch (error) {
        if (error instanceof Refused) throw error;
        throw new Refused(0, {title: 'unreachable'});
    }
}

/** What an answer says; throws where it is a refusal. */
async function parsedOf(response) {
    const given = response.headers.get('Content-Type') ?? '';
    const parsed = given.includes('json') ? await response.json() : {detail: await response.text()};
    if (!response.ok) throw new Refused(response.status, parsed);
    costs.set(parsed, response.headers.get('Panelgate-Transactions')?.split(',').map(transaction) ?? []);
    return parsed;
}

/** `body`: an object, or JSON as it shall be sent. */
function ask(method, path, body, limit) {
    const options = {method};
    if (body !== undefined) {
        options.body = typeof body === 'string' ? body : JSON.stringify(body);
        options.headers = {'Content-Type': 'application/json'};
    }
    return send(path, options, parsedOf, limit);
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
/** From the panel itself. */
export const getFromPanel = (path) => ask('GET', path, undefined, patience());
export const put = (path, body) => ask('PUT', path, body, patience());
export const remove = (path) => ask('DELETE', path, undefined, patience());
export const post = (path, body) => ask('POST', path, body, patience());

/** An answer as a file, for a link carries no token. */
export const getFile = (target, accept) => send(target, accept ? {headers: {Accept: accept}} : {}, (response) => response.ok ? response.blob() : parsedOf(response), LONG);

/** A text, and the ETag that names it. */
export function getText(target) {
    return send(target, {}, async (response) => response.ok ? {text: await response.text(), etag: response.headers.get('ETag')} : parsedOf(response));
}

/** Sends a text; what is answered, and the ETag of that. The check of a long one takes a while. */
export function sendText(method, target, body, headers = {}) {
    return send(target, {method, body, headers: {'Content-Type': 'text/yaml', ...headers}},
        async (response) => ({...await parsedOf(response), etag: response.headers.get('ETag')}), LONG);
}

/**
 * Server-sent events: told(type, data) for each, ended() when there are no more; close() ends them
 * without a word. EventSource would not do, for it carries no token.
 */
export function follow(target, told, ended) {
    const stop = new AbortController();
    const read = async (response) => {
        if (!response.ok) return;
        const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
        const text = new EventText();
        for (let part = await reader.read(); !part.done; part = await reader.read()) {
            for (const {type, data} of text.add(part.value)) told(type, data);
        }
    };
    send(target, {signal: stop.signal}, read).catch(() => {}).finally(() => stop.signal.aborted || ended());
    return {close: () => stop.abort()};
}

/** /api/v1/... with each part encoded. */
export function path(...parts) {
    return '/api/v1/' + parts.map((part) => encodeURIComponent(part)).join('/');
}

/** Has the gateway this path? `pattern` as the configuration lists it: "GET /api/v1/relays". */
export function offers(pattern) {
    return gateway.configuration?.rest.some((route) => `${route.method} ${route.path}` === pattern) ?? false;
}

/** May we see what is on the wire of this line? */
export const seesWhole = (line) => gateway.configuration?.lines.find((one) => one.name === line)?.whole !== false;

const may = (right) => gateway.rights.includes(right);
export const mayWrite = () => may('write');
export const mayAcknowledge = () => may('acknowledge');
/** May change the text of the configuration. */
export const mayConfigure = () => may('configure') && offers('PUT /api/v1/configuration/text');
export const mayDiscover = () => may('discover');
/** May set faults of simulated panels. */
export const maySimulate = () => may('simulator');

/** Learns what is configured, and what we may do. */
export async function introduce() {
    const {configuration, rest, rights, role, text, version} = await get(path('configuration'));
    gateway.text = text ?? {writable: false};
    gateway.configuration = {...configuration, rest, version};
    gateway.role = role;
    gateway.rights = rights;
    gateway.build = offers('GET /api/v1/version') ? await get(path('version')) : null;
}

/** Takes another token; throws when the gateway does not know it. */
export async function useToken(given) {
    const before = token;
    token = given;
    try {
        await introduce();
    } catch (error) {
        token = before;
        throw error;
    }
    keep();
}

function keep() {
    try {
        if (token) sessionStorage.setItem('panelgate.token', token);
        else sessionStorage.removeItem('panelgate.token');
    } catch { /* it is kept for as long as this page is */ }
}

/** From here on we are nobody in particular. */
export function forgetToken() {
    token = null;
    keep();
}

export const hasToken = () => token !== null;
