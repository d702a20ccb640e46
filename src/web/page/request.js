// The request box: any notation of any panel. Shows the frame before it goes, and explains the answer.
import {costOf, get, getFromPanel, mayConfigure, mayWrite, offers, path} from './api.js';
import {insert} from './configuration_draft.js';
import {choice, h, replace, table} from './dom.js';
import {confirmMemory, planView, refusal} from './confirm.js';
import {notations} from './frame_view.js';
import {duration, t} from './language.js';
import {live} from './live.js';
import {askToken} from './token.js';

const TABLES = ['holding-registers', 'input-registers', 'coils', 'discrete-inputs'];
const EVERY_TYPE = 16;  // registers that the gateway interprets at once
const PAUSE = 250;  // ms without a key: then the frame is shown

/** "UW100", or "holding-registers/100" and "hr 100" for panels without a profile. */
function parts(given) {
    const [, table, address] = /^\s*([a-z-]+)[\s/:]+(\d+|0x[0-9a-f]+)\s*$/i.exec(given) ?? [];
    const known = TABLES.find((name) => name === table?.toLowerCase() || name.split('-').map((word) => word[0]).join('') === table?.toLowerCase());
    return known ? [known, address] : ['devices', given.trim()];
}

/** A typed whole number, or null: "1,250" may be two, or one. */
const whole = (typed) => /^-?(\d+|0x[\da-f]+)$/i.test(typed) ? Number(typed) : typed === 'true' ? 1 : typed === 'false' ? 0 : null;

/** Where the bus scope shows what an answer has cost. */
function onTheWire(body) {
    const own = live.stations.find((one) => one.name === body.station)?.line ?? body.station?.split(':')[0];
    return costOf(body).filter(([line]) => line ?? own).map(([line, number]) => [' · ', h('a', {href: `#/scope/${line ?? own}/t${number}`}, t('on.wire', {number}))]);
}

class Box {
    #timer = null;
    #asked = 0;

    constructor(station) {
        const options = live.stations.map((one) => [one.name, `${one.name} (${one.line}:${one.id})`]);
        this.station = choice(t('station'), options, station, () => this.#soon());
        this.where = h('input', {id: 'where', placeholder: 'UW100', autocomplete: 'off', autocapitalize: 'characters', spellcheck: false, required: true,
            oninput: () => this.#soon(), 'aria-describedby': 'where-hint'});
        this.count = h('input', {id: 'count', type: 'number', min: 1, max: 2000, value: 1, oninput: () => this.#soon()});
        this.plan = h('div', {class: 'plan', 'aria-live': 'polite'});
        this.answer = h('div', {class: 'answer', 'aria-live': 'polite'});
        this.answered = h('section', {class: 'card', 'aria-label': t('answer'), hidden: true}, h('h2', null, t('answer')), this.answer);
        this.values = h('input', {id: 'values', placeholder: '215 216', autocomplete: 'off'});
        this.writing = h('div');
        this.node = h('div', null, h('h1', null, t('nav.request')), h('section', {class: 'card'}, this.#form()),
            h('section', {class: 'card', 'aria-label': t('frame.before')}, h('h2', null, t('frame.before')), this.plan),
            this.answered,
            h('section', {class: 'card', 'aria-label': t('write')}, h('h2', null, t('write')), this.writing));
        this.#offerWriting();
        this.#soon();
    }

    #form() {
        return h('form', {class: 'request', onsubmit: (event) => { event.preventDefault(); this.#read(); }},
            h('label', null, h('span', null, t('station')), this.station),
            h('label', null, h('span', null, t('notation')), this.where),
            h('label', null, h('span', null, t('count')), this.count),
            h('button', {class: 'primary', id: 'read'}, t('read')), h('p', {class: 'muted hint', id: 'where-hint'}, t('notation.hint')));
    }

    #offerWriting() {
        const form = h('form', {class: 'request two', onsubmit: (event) => { event.preventDefault(); this.#write(); }},
            h('label', null, h('span', null, t('values')), this.values), h('button', {class: 'danger', id: 'write'}, t('write.ask')));
        const barred = h('div', null, h('p', {id: 'role-needed'}, t('role.needed')),
            h('button', {type: 'button', onclick: () => askToken().then(() => this.#offerWriting())}, t('token.enter')));
        replace(this.writing, mayWrite() ? form : barred);
    }

    #say(...nodes) {
        this.answered.hidden = false;
        replace(this.answer, ...nodes);
    }

    get #target() { return [this.station.value, ...parts(this.where.value)]; }

    #soon() {
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.#showPlan(), PAUSE);
    }

    async #showPlan() {
        const [station, kind, where] = this.#target;
        const route = `GET /api/v1/stations/{}/${kind === 'devices' ? 'devices/{}' : '{}/{}'}/plan`;
        if (where === '' || !offers(route)) return replace(this.plan, h('p', {class: 'muted'}, t('plan.empty')));
        const turn = ++this.#asked;
        let shown;
        try {
            const plan = await get(path('stations', station, kind, where, 'plan') + `?count=${this.count.value || 1}`);
            shown = [h('p', null, t('plan.said', {line: plan.line, id: plan.id, table: plan.table, address: plan.address, count: plan.count})), planView(plan)];
        } catch (error) {
            shown = refusal(error);
        }
        if (turn === this.#asked) replace(this.plan, ...[shown].flat());
        return null;
    }

    async #read() {
        const [station, kind, where] = this.#target;
        this.#say(h('p', {class: 'muted'}, t('asking')));
        const begin = performance.now();
        try {
            const body = await getFromPanel(path('stations', station, kind, where) + `?count=${this.count.value || 1}`);
            const names = await notations(station, body.table, body.address, body.values.length);
            this.#say(this.#explained(body, names, performance.now() - begin));
        } catch (error) {
            this.#say(refusal(error));
        }
    }

    #explained(body, names, took) {
        const shown = table(t('values'), [[t('notation')], [t('address'), 'number'], [t('value'), 'number'], ['i16', 'number'], ['hex', 'number']]);
        shown.body.append(...body.values.map((value, i) => h('tr', {class: 'value'}, h('td', {class: 'strong'}, names[i] ?? (i === 0 ? body.notation : '') ?? ''),
            h('td', {class: 'number'}, body.address + i), h('td', {class: 'number strong'}, String(value)),
            h('td', {class: 'number'}, typeof value === 'number' && value > 32767 ? value - 65536 : ''),
            h('td', {class: 'number mono'}, typeof value === 'number' && value >= 0 ? value.toString(16).toUpperCase().padStart(4, '0') : ''))));
        const source = body.source === 'cache' ? t('from.cache', {age: duration(body.age_ms)}) : t('from.bus', {took: duration(took)});
        return h('div', null, h('p', null, `${body.station} · ${body.table} ${body.address} · `, source,
            body.transactions > 1 ? ' · ' + t('more.requests', {count: body.transactions}) : '', onTheWire(body)), shown.node, h('div', {class: 'bar'}, this.#point(body)), this.#everyType(body));
    }

    /** Puts a point at what was read into the text of the configuration, and shows it there. */
    #point({station, notation}) {
        const listed = live.stations.find((one) => one.name === station);
        if (!mayConfigure() || !listed || !notation) return null;
        const item = {name: notation.toLowerCase().replace(/[^a-z0-9]+/g, '-'), at: notation};
        const add = () => insert(`lines/${listed.line}/stations/${station}/points`, item).catch((error) => this.#say(refusal(error)));
        return h('button', {type: 'button', id: 'make-point', onclick: add}, t('text.add.point'));
    }

    /** Of a few registers on demand, because it asks the panel once more: what they are as each type. */
    #everyType(body) {
        if (!body.table.endsWith('registers') || body.values.length > EVERY_TYPE) return null;
        const place = h('div');
        const look = async () => {
            try {
                const {interpretations} = await getFromPanel(path('stations', body.station, body.table, String(body.address), 'interpretations') + `?count=${body.values.length}`);
                const shown = table(t('every.type'), [[t('type')], [t('word.order')], [t('values')]]);
                shown.body.append(...interpretations.map((one) => h('tr', null, h('td', null, one.type), h('td', null, one.word_order),
                    h('td', {class: 'mono'}, one.values.map((value) => value ?? '–').join('  ')))));
                replace(place, shown.node);
            } catch (error) {
                replace(place, refusal(error));
            }
        };
        replace(place, h('button', {type: 'button', onclick: look}, t('every.type')));
        return place;
    }

    #write() {
        const [station, kind, where] = this.#target;
        const values = this.values.value.split(/\s*[\s;]\s*|,\s+/).filter(Boolean).map(whole);
        if (where === '' || values.length === 0 || values.includes(null)) return this.#say(h('p', {class: 'refusal', role: 'alert'}, t('values.hint')));
        return confirmMemory(station, [kind, where], values, (...nodes) => this.#say(...nodes));
    }
}

export function requestView({argument}) {
    if (live.stations.length === 0) return {node: h('p', {class: 'empty'}, t('no.lines'))};
    const box = new Box(argument ?? live.stations[0].name);
    return {node: box.node};
}
