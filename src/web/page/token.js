// Who we are to the gateway. The token is kept for this tab alone.
import {Refused, forgetToken, gateway, hasToken, useToken} from './api.js';
import {dialog, refusal} from './confirm.js';
import {attribute, h, replace, text} from './dom.js';
import {t, word} from './language.js';

/** A form that asks until the gateway knows what it is given, and then calls taken(). */
function tokenForm(taken, buttons) {
    const input = h('input', {id: 'token', type: 'password', autocomplete: 'off', required: true, autofocus: true});
    const outcome = h('div');
    const use = h('button', {class: 'primary'}, t('token.use'));
    const take = async () => {
        use.disabled = true;
        try {
            await useToken(input.value.trim());
            taken();
        } catch (error) {
            replace(outcome, error instanceof Refused && error.status === 401 ? h('p', {class: 'refusal', role: 'alert'}, t('token.unknown')) : refusal(error));
            input.select();
        }
        use.disabled = false;
    };
    return h('form', {method: 'dialog', onsubmit: (event) => { event.preventDefault(); take(); }}, h('p', {class: 'muted'}, t('token.hint')),
        h('label', {for: 'token'}, t('token')), input, outcome, h('div', {class: 'bar end'}, buttons, use));
}

/** Where nobody in particular may look: ends when there is a token. `forgotten`: the one we had is none any more. */
export function signIn(place, forgotten) {
    return new Promise((resolve) => {
        const form = tokenForm(resolve, []);
        replace(place, h('section', {class: 'card', id: 'sign-in'}, h('h1', null, t('token.enter')),
            h('p', null, t(forgotten ? 'token.unknown' : 'token.needed')), form));
        form.querySelector('input').focus();
    });
}

/** Without its token the page begins anew: another may be needed to see anything. */
function signOut() {
    forgetToken();
    location.reload();
}

/** Lets somebody become another, or nobody in particular; ends when that is settled. */
export function askToken() {
    return new Promise((resolve) => {
        const taken = () => { document.dispatchEvent(new Event('role')); node.close(); };
        const buttons = [hasToken() ? h('button', {type: 'button', id: 'sign-out', onclick: signOut}, t('token.forget')) : null,
            h('button', {type: 'button', onclick: () => node.close()}, t('cancel'))];
        const node = dialog(t('token.enter'), tokenForm(taken, buttons));
        node.addEventListener('close', resolve);
    });
}

/** The button that says who we are. */
export function roleButton() {
    const node = h('button', {type: 'button', class: 'quiet', id: 'role', onclick: askToken});
    const show = () => {
        text(node, word('role', gateway.role));
        for (const name of ['aria-label', 'title']) attribute(node, name, t('role', {role: word('role', gateway.role)}));
    };
    document.addEventListener('role', show);
    show();
    return node;
}
