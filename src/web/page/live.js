// What lines and stations are now. Asked once a second while the page is seen, and at once when an
// event says that something has changed; a page that nobody sees asks for the sake of its title.
import {follow, get, offers, path} from './api.js';

const PERIOD = 1000;  // ms
const BEHIND = 10000; // ms
const FINDINGS = 5000; // ms between two looks at the gateway's findings
const OLD = 4000;     // ms without an answer: what is shown may be wrong
const SOON = 60;      // ms: events of one moment are one reason to ask
/** States that a transaction's outcome makes old. */
const BACK = ['suspect', 'offline', 'unknown'];
const CONTRADICTS = {ok: BACK, exception: BACK, timeout: ['online', 'unknown'], damaged: ['online', 'unknown'], offline: ['online', 'suspect']};

class Live extends EventTarget {
    lines = [];
    stations = [];
    findings = [];    // of the gateway itself, and overloads with their line
    reachable = true;
    heard = 0;        // ms since 1970: when the gateway has answered last
    refused = false;  // who we are may not see it
    #timer = null;
    #events = null;
    #asking = false;
    #started = false;
    #due = false;
    #looked = -Infinity;

    start() {
        this.#started = true;
        document.addEventListener('visibilitychange', () => this.#seen());
        setInterval(() => document.hidden || this.silence < 2 * PERIOD || this.#tell('status'), PERIOD);
        this.#seen();
    }

    get silence() { return Math.max(0, Date.now() - this.heard); }
    /** May what is shown be wrong, because the gateway is silent? */
    get old() { return !this.reachable || this.silence > OLD; }
    /** How old something is by now that was `ms` old when the gateway told it. */
    ago(ms) { return ms === null ? null : ms + this.silence; }

    line(name) { return this.lines.find((line) => line.name === name); }
    station(name) { return this.stations.find((station) => station.name === name); }
    /** By line and id, as frames name it. */
    at(line, id) { return this.stations.find((station) => station.line === line && station.id === id); }

    /** The browser has few connections to one host: a page that nobody sees keeps none. */
    #seen() {
        if (document.hidden) return this.#rest();
        this.#tell('status');
        this.#listen();
        return this.refresh();
    }

    #rest() {
        this.#hangUp();
        this.#tell('rest');
    }

    #hangUp() {
        this.#events?.close();
        this.#events = null;
    }

    #listen() {
        if (!this.#started || this.#events) return;
        const discovers = offers('POST /api/v1/lines/{}/discover');
        const types = ['station', 'line', 'transaction', 'point', ...discovers ? ['discovery'] : []];
        this.#events = follow(path('events') + `?types=${types}`, (type, data) => this.#take(type, JSON.parse(data)),
            () => { this.#events = null; });
    }

    #take(type, told) {
        if (type === 'discovery' || type === 'point') return this.#tell(type, told);
        if (type !== 'transaction') return this.#soon();
        const now = this.stations.find((s) => s.line === told.line && s.name === told.station);
        if (now && CONTRADICTS[told.outcome]?.includes(now.state)) this.#soon();
    }

    #soon() {
        if (document.hidden || this.#due) return;
        this.#due = true;
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.refresh(), SOON);
    }

    async refresh() {
        if (this.#asking) return;
        this.#asking = true;
        this.#due = false;
        try {
            const [lines, stations] = await Promise.all([get(path('lines')), get(path('stations') + (document.hidden ? '' : '?overview=true')), this.#look()]);
            this.#hear(lines.lines, stations.stations);
        } catch (error) {
            if (error.status === 401) return this.#refuse();
            this.reachable = false;
            this.#hangUp();
        }
        this.#asking = false;
        this.#tell('status');
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.refresh(), document.hidden ? BEHIND : this.#due ? SOON : PERIOD);
    }

    async #look() {
        if (!offers('GET /api/v1/findings') || performance.now() - this.#looked < FINDINGS) return;
        this.#looked = performance.now();
        try { this.findings = (await get(path('findings'))).findings; } catch { /* the next look will do */ }
    }

    /** Nobody on a line that is down can answer, whatever he was before. */
    #hear(lines, stations) {
        Object.assign(this, {lines, stations, reachable: true, refused: false, heard: Date.now()});
        for (const station of stations) if (this.line(station.line)?.up === false) station.state = 'line_down';
        if (!document.hidden) this.#listen();
    }

    /** To ask again is no use without another token. */
    #refuse() {
        this.#asking = false;
        this.refused = true;
        clearTimeout(this.#timer);
        this.#rest();
        this.#tell('refused');
    }

    #tell(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }
}

export const live = new Live();
