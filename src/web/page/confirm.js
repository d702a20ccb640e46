// Nothing is written without being shown first and confirmed.
import {Refused, get, offers, path, put} from './api.js';
import {h} from './dom.js';
import {explain} from './frame.js';
import {frameView} from './frame_view.js';
import {explained, problemPage} from './help.js';
import {bytesOf} from './timeline.js';
import {t} from './language.js';
import {shownValue} from './point_values.js';

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

/** Writes, and says with done(node) what came of it; the answer, or null. `unit`: of the answer's value. */
export async function send(target, body, done, unit) {
    try {
        const answer = await put(target, body);
        done(h('p', {class: 'success', role: 'status'}, answer.value === undefined ? t('written') : t('written.value', {value: shownValue({...answer, unit})})));
        return answer;
    } catch (error) {
        done(refusal(error), error.status === 0 ? h('p', {class: 'warning'}, t('write.unknown')) : null);
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
