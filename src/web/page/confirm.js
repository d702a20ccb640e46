// Nothing is written without being shown first and confirmed.
import {Refused, get, offers, path, put} from './api.js';
import {h, replace} from './dom.js';
import {explain} from './frame.js';
import {frameView} from './frame_view.js';
import {explained, problemPage} from './help.js';
import {bytesOf} from './timeline.js';
import {t} from './language.js';
import {remember, shownValue} from './point_values.js';

/** A dialog with a heading; `close` is its own, too. */
export function dialog(title, ...content) {
    const heading = h('h2', {id: 'dialog-title'}, title);
    const node = h('dialog', {'aria-labelledby': 'dialog-title', onclose: () => node.remove()}, heading, content);
    document.body.append(node);
    node.showModal();
    return node;
}

/** Asks whether it shall be done; true, or false for every other way out. */
export function confirm(title, content, action) {
    return new Promise((resolve) => {
        let said = false;
        const answer = (value) => () => { said = value; node.close(); };
        const node = dialog(title, content, h('div', {class: 'bar end'},
            h('button', {type: 'button', autofocus: true, onclick: answer(false)}, t('cancel')),
            h('button', {type: 'button', class: 'danger', id: 'confirm', onclick: answer(true)}, action)));
        node.addEventListener('close', () => resolve(said));
    });
}

/** Why something was refused, in the gateway's words. */
export function refusal(error) {
    const problem = error instanceof Refused ? error.problem : {detail: String(error)};
    const page = problemPage(problem);
    const facts = [error.status || null, problem.rule, problem.transmitted === false ? t('not.sent') : problem.transmitted ? t('was.sent') : null];
    return h('p', {class: 'refusal', role: 'alert'}, h('strong', {lang: 'en'}, problem.detail ?? t('unreachable')), ' ',
        h('small', null, facts.filter(Boolean).join(' · '), page ? [' · ', explained(page, problem.title)] : null));
}

/** The frame of a plan, or nothing where the gateway does not tell it. */
export function planView(plan) {
    const found = explain(bytesOf(plan.frame), false);
    return h('div', null, frameView(found, plan.notations), plan.requests > 1 ? h('p', {class: 'muted'}, t('more.requests', {count: plan.requests})) : null);
}

async function send(target, body, done) {
    try {
        const answer = await put(target, body);
        done(h('p', {class: 'success', role: 'status'}, answer.value === undefined ? t('written') : t('written.value', {value: String(answer.value)})));
        return answer;
    } catch (error) {
        done(refusal(error));
        return null;
    }
}

/** Writes values to memory of a station after confirmation: `where` as the path's parts behind it. */
export async function confirmMemory(station, where, values, done) {
    const target = path('stations', station, ...where);
    let frame = null;
    const [kind] = where;
    const route = kind === 'devices' ? 'GET /api/v1/stations/{}/devices/{}/plan' : 'GET /api/v1/stations/{}/{}/{}/plan';
    try {
        if (offers(route)) frame = planView(await get(`${target}/plan?values=${values.join(',')}`));
    } catch (error) {
        return done(refusal(error));
    }
    const said = h('p', null, t('confirm.write', {what: `${where.at(-1)} = ${values.join(', ')}`, station}));
    if (await confirm(t('write'), [said, frame, h('p', {class: 'warning'}, t('confirm.warning'))], t('write.now'))) {
        return send(target, {values}, done);
    }
    return null;
}

/** A value as people type it, for JSON: a number, true and false, or the text of a label. */
function typed(point, given) {
    if (point.type === 'bool' || typeof point.value === 'boolean') return /^(1|true|on)$/i.test(given.trim());
    const digits = given.trim().replace(',', '.');
    return digits !== '' && !Number.isNaN(Number(digits)) ? Number(digits) : given;
}

/** A point's new value: asked for, shown, confirmed. */
export function confirmWrite({station, point}) {
    const input = h('input', {id: 'new-value', required: true, autocomplete: 'off'});
    const outcome = h('div');
    const form = h('form', {method: 'dialog'}, h('p', {class: 'muted'}, `${t('value')}: ${shownValue(point)}`),
        h('label', {for: 'new-value'}, t('new.value')), input, outcome,
        h('div', {class: 'bar end'}, h('button', {type: 'button', onclick: () => node.close()}, t('close')), h('button', {class: 'primary'}, t('write.ask'))));
    const node = dialog(`${station}/${point.name}`, form);
    form.addEventListener('submit', async (event) => {
        event.preventDefault();
        const value = typed(point, input.value);
        const said = h('p', null, t('confirm.write', {what: `${point.name} = ${value} ${point.unit}`, station}));
        if (!await confirm(t('write'), [said, h('p', {class: 'warning'}, t('confirm.warning'))], t('write.now'))) return;
        const answer = await send(path('stations', station, 'points', point.name), {value}, (node_) => replace(outcome, node_));
        if (answer) remember(`${station}/${point.name}`, answer.value);
    });
}
