// Alarms: what holds now, and who knows.
import {get, mayAcknowledge, offers, path, post} from './api.js';
import {attribute, h, list, table, text} from './dom.js';
import {clockTime, number, store, stored, t, word, zone} from './language.js';

const PERIOD = 2000;  // ms

/** The alarms as they were asked for last: {all, waiting}; whoever listens is told. */
class Alarms extends EventTarget {
    all = [];
    heard = new Set();

    /** Nobody has acknowledged these. */
    get waiting() { return this.all.filter((alarm) => alarm.state === 'active' || alarm.state === 'cleared'); }

    async ask() {
        const {alarms: all} = await get(path('alarms'));
        const active = new Set(all.filter((alarm) => alarm.state === 'active').map((alarm) => alarm.name));
        if (stored('sound') === 'on' && [...active].some((name) => !this.heard.has(name))) beep();
        this.heard = active;
        this.all = all;
        this.dispatchEvent(new Event('change'));
    }
    start() {
        if (!offers('GET /api/v1/alarms')) return;
        const ask = () => this.ask().catch(() => { /* the bar above the page says it */ });
        ask();
        setInterval(ask, PERIOD);
    }
}
export const alarms = new Alarms();

function beep() {
    const audio = new AudioContext();
    const tone = new OscillatorNode(audio, {frequency: 880});
    tone.connect(new GainNode(audio, {gain: 0.2})).connect(audio.destination);
    tone.start();
    tone.stop(audio.currentTime + 0.4);
    tone.onended = () => audio.close();
}

const TONES = {active: 'bad', acknowledged: 'warn', cleared: 'warn', normal: 'good'};

/** Its name, where the text is another, and what it watches. */
function about({name, text: shown, station, point}) {
    const said = [shown === name ? '' : name, [station, point].filter(Boolean).join('/')].filter(Boolean).join(' · ');
    return said ? [' ', h('small', {class: 'muted'}, said)] : null;
}

function row(first) {
    const [state, since, value, by] = [h('span'), h('td', {class: 'figure'}), h('td', {class: 'number'}), h('td')];
    const failed = h('small', {class: 'problem'});
    const button = h('button', {type: 'button', onclick: async () => {
        try {
            await post(`${path('alarms', first.name, 'acknowledge')}`, {});
            text(failed, '');
        } catch (error) {
            text(failed, error.message);
        }
        alarms.ask().catch(() => {});
    }}, t('acknowledge'));
    return {node: h('tr', {'data-alarm': first.name}, h('th', {scope: 'row', class: 'wide'}, first.text, about(first)), h('td', null, state), since, value, h('td', null, word('severity', first.severity)), by, h('td', null, mayAcknowledge() ? button : null, failed)), update: (alarm) => {
        attribute(state, 'class', `badge ${TONES[alarm.state]}`);
        text(state, word('alarm', alarm.state));
        text(since, alarm.since === null ? '–' : clockTime(Date.parse(alarm.since)));
        text(value, alarm.value === null ? '–' : number(alarm.value, 3));
        text(by, alarm.acknowledged_by ?? '');
        button.hidden = alarm.state !== 'active' && alarm.state !== 'cleared';
    }};
}

/** What nobody knows of comes first, then what holds. */
const ORDER = {active: 0, cleared: 1, acknowledged: 2, normal: 3};

export function alarmsView() {
    const shown = table(t('nav.alarms'), [[t('alarm')], [t('state')], [`${t('since')} (${zone})`], [t('value'), 'number'], [t('severity')], [t('acknowledged.by')], ['']]);
    const none = h('p', {class: 'empty', hidden: true}, t('alarms.none'));
    const sound = h('input', {type: 'checkbox', checked: stored('sound') === 'on', onchange: () => store('sound', sound.checked ? 'on' : 'off')});
    const node = h('div', null, h('h1', null, t('nav.alarms')), shown.node, none, h('p', null, h('label', {class: 'tick'}, sound, ' ', t('alarms.sound'))));
    const show = () => {
        const sorted = alarms.all.toSorted((a, b) => ORDER[a.state] - ORDER[b.state] || a.name.localeCompare(b.name));
        list(shown.body, sorted, (alarm) => alarm.name, row);
        none.hidden = sorted.length > 0;
        shown.node.hidden = sorted.length === 0;
    };
    alarms.addEventListener('change', show);
    show();
    return {node, stop: () => alarms.removeEventListener('change', show)};
}
