'use strict';
// Added to the report when `substep review` serves it: buttons that approve and reject.

async function ask(what, body) {
  const answer = await fetch(what, {method: 'POST', body: JSON.stringify(body)});
  const said = await answer.json();
  if (!answer.ok) throw new Error(said.error);
  return said.left;
}

function decide(entry, buttons, what, past, alternate) {
  return async () => {
    const reason = prompt(`${entry.id}: why is it ${past}?`);
    if (!reason || !reason.trim()) return;
    try {
      const left = await ask(what, {cases: [entry.id], reason, alternate});
      buttons.replaceChildren(` ${past}: ${reason}`);
      if (left.length === 0) document.querySelector('.review').textContent = 'All is decided: this page can be closed.';
    } catch (error) {
      alert(error.message);
    }
  };
}

for (const entry of document.querySelectorAll('section.case')) {
  if (!entry.querySelector('code.replay')) continue;
  const buttons = element('span', {class: 'decide'});
  if (entry.querySelector('code.approve')) {
    buttons.append(element('button', {onclick: decide(entry, buttons, 'approve', 'approved', false)}, 'Approve'), ' ');
  } else if (entry.querySelector('code.alternate')) {
    buttons.append(element('button', {onclick: decide(entry, buttons, 'approve', 'approved', true)}, 'Approve beside'), ' ');
  }
  buttons.append(element('button', {onclick: decide(entry, buttons, 'reject', 'rejected', false)}, 'Reject'));
  entry.querySelector('header').append(buttons);
}
const done = element('button', {onclick: async () => {
  await ask('done', {});
  document.querySelector('.review').textContent = 'The review has ended: this page can be closed.';
}}, 'End the review');
document.querySelector('header.top').append(element('p', {class: 'review'}, done));
