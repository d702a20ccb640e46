// What lines and stations are now. Asked once a second while the page is seen, and at once when an
// event says that something has changed.
import {get, offers, path} from './api.js';
import {EventStream} from './event_stream.js';

const PERIOD = 1000;  // ms
const SOON = 60;      // ms: events of one moment are one reason to ask
/** States that a transaction's outcome makes old. */
const BACK = ['suspect', 'offline', 'unknown'];
const CONTRADICTS = {ok: BACK, exception: BACK, timeout: ['online', 'unknown'], damaged: ['online', 'unknown'], offline: ['online', 'suspect']};

class Live extends EventTarget {
    lines = [];
    stations = [];
    reachable = true;
    /** The gateway wants a token that it knows. */
    refused = false;
    #timer = null;
    #source = null;
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
            this.#source?.close();
            clearTimeout(this.#timer);
            return;
        }
        this.#listen();
        this.refresh();
    }

    #listen() {
        if (!this.#started) return;
        if (this.#source && !this.#source.closed) return;
        const discovers = offers('POST /api/v1/lines/{}/discover');
        const types = ['station', 'line', 'transaction', 'point', ...discovers ? ['discovery'] : []];
        this.#source = new EventStream(path('events') + `?types=${types}`, this.#source?.last);
        this.#source.addEventListener('discovery', (event) => this.#tell('discovery', JSON.parse(event.data)));
        for (const type of ['station', 'line', 'lost']) this.#source.addEventListener(type, () => this.#soon());
        this.#source.addEventListener('transaction', (event) => {
            const told = JSON.parse(event.data);
            const now = this.stations.find((s) => s.line === told.line && s.name === told.station);
            if (now && CONTRADICTS[told.outcome]?.includes(now.state)) this.#soon();
        });
        this.#source.addEventListener('point', (event) => this.#tell('point', JSON.parse(event.data)));
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
            this.refused = error.status === 401;
            this.reachable = this.refused;
        }
        this.#asking = false;
        this.#tell('status');
        clearTimeout(this.#timer);
        if (!document.hidden && !this.refused) this.#timer = setTimeout(() => this.refresh(), this.#due ? SOON : PERIOD);
    }

    #tell(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }
}

export const live = new Live();
