// What lines and stations are now. Asked once a second while the page is seen, and at once when an
// event says that something has changed.
import {follow, get, offers, path} from './api.js';

const PERIOD = 1000;  // ms
const SOON = 60;      // ms: events of one moment are one reason to ask
/** States that a transaction's outcome makes old. */
const BACK = ['suspect', 'offline', 'unknown'];
const CONTRADICTS = {ok: BACK, exception: BACK, timeout: ['online', 'unknown'], damaged: ['online', 'unknown'], offline: ['online', 'suspect']};

class Live extends EventTarget {
    lines = [];
    stations = [];
    reachable = true;
    refused = false;  // who we are may not see it
    #timer = null;
    #events = null;
    #asking = false;
    #started = false;
    #due = false;

    start() {
        this.#started = true;
        document.addEventListener('visibilitychange', () => this.#seen());
        this.#seen();
    }

    line(name) { return this.lines.find((line) => line.name === name); }
    station(name) { return this.stations.find((station) => station.name === name); }
    /** By line and id, as frames name it. */
    at(line, id) { return this.stations.find((station) => station.line === line && station.id === id); }

    /** The browser has few connections to one host: a page that nobody sees keeps none. */
    #seen() {
        if (document.hidden) {
            this.#rest();
            return;
        }
        this.#listen();
        this.refresh();
    }

    #rest() {
        this.#events?.close();
        this.#events = null;
        clearTimeout(this.#timer);
        this.#tell('rest');
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
            const [lines, stations] = await Promise.all([get(path('lines')), get(path('stations'))]);
            this.lines = lines.lines;
            this.stations = stations.stations;
            this.reachable = true;
            this.refused = false;
            this.#listen();
        } catch (error) {
            if (error.status === 401) return this.#refuse();
            this.reachable = false;
        }
        this.#asking = false;
        this.#tell('status');
        clearTimeout(this.#timer);
        if (!document.hidden) this.#timer = setTimeout(() => this.refresh(), this.#due ? SOON : PERIOD);
    }

    /** To ask again is no use without another token. */
    #refuse() {
        this.#asking = false;
        this.refused = true;
        this.#rest();
        this.#tell('refused');
    }

    #tell(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }
}

export const live = new Live();
