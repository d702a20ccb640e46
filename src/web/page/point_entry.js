// A point's new value: entered by the point's type, judged before it is asked, and written when that is confirmed.
import {get, offers, path} from './api.js';
import {dialog, planView, refusal, send} from './confirm.js';
import {h, replace} from './dom.js';
import {decimalOf, decimalText, t, word} from './language.js';
import {keyOf, remember, shownValue} from './point_values.js';

const PLAN = 'GET /api/v1/stations/{}/points/{}/plan';

/** "0 … 60 °C, in steps of 0.1"; '' where nothing is known. */
function limits({min, max, step, unit}) {
    const ends = [min, max].filter((one) => one !== undefined).map(decimalText);
    const range = ends.length === 2 ? ends.join(' … ') : min !== undefined ? `≥ ${ends[0]}` : max !== undefined ? `≤ ${ends[0]}` : '';
    return [[range, range && unit ? word('unit', unit) : ''].filter(Boolean).join('\u00a0'), step === undefined ? '' : t('value.step', {step: decimalText(step)})].filter(Boolean).join(', ');
}

/** Two buttons: each says its value by itself. */
function switches(take) {
    const button = (value) => h('button', {type: 'button', 'data-value': String(value), onclick: () => take({json: String(value), value})}, t(value ? 'on' : 'off'));
    return {node: h('div', {class: 'bar'}, button(true), button(false))};
}

function names(labels, now) {
    const select = h('select', {id: 'new-value'}, labels.map((label) => h('option', {value: label, selected: label === now}, label)));
    return {node: select, read: () => ({json: JSON.stringify(select.value), value: select.value})};
}

function numeral(point) {
    const input = h('input', {id: 'new-value', inputmode: 'decimal', autocomplete: 'off', required: true, 'aria-describedby': 'limits'});
    const read = () => {
        const json = decimalOf(input.value);
        if (json === null) return {wrong: t('value.number', {example: decimalText(1250.5)})};
        if (Number(json) < point.min || Number(json) > point.max) return {wrong: t('value.outside', {range: limits(point)})};
        return {json, value: decimalText(json)};
    };
    return {node: [input, h('small', {class: 'muted', id: 'limits'}, limits(point))], read};
}

function words() {
    const input = h('input', {id: 'new-value', autocomplete: 'off'});
    return {node: input, read: () => ({json: JSON.stringify(input.value), value: input.value})};
}

/** What asks for a value of this point: {node, read}. read(), or take(), gives {json, value}: as it is sent, and as shownValue() has it; or {wrong}. */
function fieldOf(point, take) {
    if (point.type === 'bool') return switches(take);
    const labels = Object.values(point.labels ?? {});
    if (labels.length > 0) return names(labels, point.label);
    return point.type === 'string' ? words() : numeral(point);
}

class Entry {
    #written = null;  // what the panel has confirmed, and when

    /** `point()`: the point as it is known now. */
    constructor(station, point) {
        this.point = point;
        this.key = keyOf(station, point().name);
        this.target = path('stations', station, 'points', point().name);
        this.place = h('div');
        this.outcome = h('div');
        this.node = dialog(this.key, this.place);
        this.#enter();
    }

    /** A poll that came after our write knows better than its answer. */
    get #now() {
        const told = this.point();
        return this.#written && told.heard - (told.age_ms ?? 0) < this.#written.at ? {...told, ...this.#written} : told;
    }

    get #shown() {
        const now = this.#now;
        return now.quality === 'good' ? shownValue(now) : `${shownValue(now)} (${word('quality', now.quality)})`;
    }

    #say(...nodes) { replace(this.outcome, ...nodes); }

    #enter() {
        const field = fieldOf(this.#now, (value) => this.#judge(value));
        const write = field.read ? h('button', {class: 'primary'}, t('write.ask')) : null;
        const form = h('form', {onsubmit: (event) => { event.preventDefault(); this.#judge(field.read()); }},
            h('p', {class: 'muted'}, `${t('value')}: ${this.#shown}`), h('label', {for: 'new-value'}, t('new.value')), field.node, this.outcome,
            h('div', {class: 'bar end'}, h('button', {type: 'button', class: 'close', onclick: () => this.node.close()}, t('close')), write));
        replace(this.place, form);
        form.querySelector('input, select, button').focus();
    }

    /** The gateway judges what is written as it will when it is; nothing is sent. */
    async #judge(value) {
        if (value.wrong) return this.#say(h('p', {class: 'refusal', role: 'alert'}, value.wrong));
        let frame = null;
        try {
            if (offers(PLAN)) frame = planView(await get(`${this.target}/plan?value=${encodeURIComponent(value.json)}`));
        } catch (error) {
            return this.#say(refusal(error));
        }
        this.#say();
        return this.#ask(value, frame);
    }

    #ask({json, value}, frame) {
        const stay = h('button', {type: 'button', onclick: () => this.#enter()}, t('cancel'));
        const write = h('button', {type: 'button', class: 'danger', id: 'confirm', onclick: () => { write.disabled = true; this.#write(json); }}, t('write.now'));
        replace(this.place, h('p', {class: 'change'}, `${this.#shown} → `, h('strong', null, shownValue({value, unit: this.point().unit}))),
            frame, h('p', {class: 'warning'}, t('confirm.warning')), h('div', {class: 'bar end'}, stay, write));
        stay.focus();
    }

    async #write(json) {
        const answer = await send(this.target, `{"value":${json}}`, (...nodes) => this.#say(...nodes), this.point().unit);
        if (answer) {
            remember(this.key, answer.value);
            this.#written = {value: answer.value, label: answer.label, quality: 'good', at: Date.now()};
        }
        this.#enter();
    }
}

/** Asks for a new value of a point and writes it. */
export function enterPoint(station, point) { new Entry(station, point); }
