// A slice through the field along the axis of the wake, turned by a slider, by dragging or by the
// arrow keys. Samples near the plane are averaged by cell; nothing is modelled here.
'use strict';
for (const box of document.querySelectorAll('div.slice')) {
  const data = JSON.parse(box.querySelector('script').textContent), unit = 0.01;
  const canvas = box.querySelector('canvas'), turn = box.querySelector('input'), what = box.querySelector('select'), told = box.querySelector('output');
  const count = data.x.length, COLUMNS = 25, ROWS = 22;
  const reach = Math.max(0.5, ...data.x.map(Math.abs), ...data.y.map(Math.abs)) * unit, top = Math.min(...data.s) * unit, bottom = Math.max(...data.s) * unit;
  // As far beside the plane as a cell is wide, and wider away from the axis, where samples are few.
  const thick = u => Math.max(reach / COLUMNS, 0.2 * Math.abs(u));
  const sized = values => { const all = values.map(Math.abs).sort((a, b) => a - b); return Math.max(1e-9, all[Math.floor(0.95 * (all.length - 1))]); };
  const pairs = { residual: [['as simulated', data.before], ['corrected', data.after]], value: [['recorded', data.recorded], ['simulated', data.recorded.map((v, k) => v - data.before[k])], ['corrected', data.recorded.map((v, k) => v - data.after[k])]] };
  const full = { residual: sized(data.before), value: sized(data.recorded) };
  const mix = (a, b, share) => 'rgb(' + a.map((v, k) => Math.round(v + share * (b[k] - v))).join(',') + ')';
  const PAPER = [250, 250, 246], LOW = [43, 100, 168], HIGH = [200, 70, 20], DEEP = [16, 60, 110];
  const colour = (kind, v) => { const share = Math.max(-1, Math.min(1, v / full[kind])); return kind === 'value' ? mix(PAPER, DEEP, Math.max(0, share)) : share < 0 ? mix(PAPER, LOW, -share) : mix(PAPER, HIGH, share); };
  const number = v => Math.abs(v) >= 10 ? v.toFixed(0) : Math.abs(v) >= 1 ? v.toFixed(1) : v.toPrecision(2);
  const draw = () => {
    const kind = what.value, panels = pairs[kind], width = canvas.clientWidth || 900, height = 400, ratio = Math.min(devicePixelRatio || 1, 2);
    canvas.width = width * ratio; canvas.height = height * ratio; canvas.style.height = height + 'px';
    const pen = canvas.getContext('2d'), angle = Number(turn.value) * Math.PI / 180, cos = Math.cos(angle), sin = Math.sin(angle);
    pen.scale(ratio, ratio);
    pen.font = '12px Helvetica,Arial,DejaVu Sans,sans-serif';
    const left = 46, bar = 74, each = (width - bar) / panels.length, wide = each - left - 10, tall = height - 62;
    let near = 0;
    panels.forEach(([name, values], panel) => {
      const sums = new Float64Array(COLUMNS * ROWS), counts = new Uint32Array(COLUMNS * ROWS), x0 = panel * each + left, y0 = 24;
      near = 0;
      for (let k = 0; k < count; k++) {
        const x = data.x[k] * unit, y = data.y[k] * unit, u = x * cos + y * sin, v = y * cos - x * sin;
        if (Math.abs(v) > thick(u)) continue;
        near++;
        const column = Math.min(COLUMNS - 1, Math.floor((u + reach) / (2 * reach) * COLUMNS)), row = Math.min(ROWS - 1, Math.floor((data.s[k] * unit - top) / Math.max(bottom - top, 1e-9) * ROWS));
        sums[row * COLUMNS + column] += values[k]; counts[row * COLUMNS + column]++;
      }
      pen.fillStyle = '#e4e7eb'; pen.fillRect(x0, y0, wide, tall);
      for (let cell = 0; cell < counts.length; cell++) if (counts[cell]) {
        pen.fillStyle = colour(kind, sums[cell] / counts[cell]);
        pen.fillRect(x0 + (cell % COLUMNS) * wide / COLUMNS, y0 + Math.floor(cell / COLUMNS) * tall / ROWS, wide / COLUMNS + 0.5, tall / ROWS + 0.5);
      }
      pen.strokeStyle = '#7b8794'; pen.strokeRect(x0, y0, wide, tall);
      pen.setLineDash([4, 3]); pen.beginPath(); pen.moveTo(x0 + wide / 2, y0); pen.lineTo(x0 + wide / 2, y0 + tall); pen.stroke(); pen.setLineDash([]);
      pen.fillStyle = '#1f2933'; pen.textAlign = 'center'; pen.fillText(name, x0 + wide / 2, 16);
      pen.fillStyle = '#52606d';
      for (const share of [-1, -0.5, 0, 0.5, 1]) pen.fillText(number(share * reach), x0 + (share + 1) / 2 * wide, y0 + tall + 15);
      pen.textAlign = 'right';
      for (const share of [0, 0.25, 0.5, 0.75, 1]) pen.fillText(number(top + share * (bottom - top)), x0 - 5, y0 + share * tall + 4);
    });
    pen.textAlign = 'left'; pen.fillStyle = '#52606d';
    pen.fillText('across: distance from the axis r / l, right: azimuth ' + turn.value + '°; down: depth s / l', left, height - 8);
    for (let k = 0; k < 100; k++) { const share = kind === 'value' ? 1 - k / 100 : 1 - k / 50; pen.fillStyle = colour(kind, share * full[kind]); pen.fillRect(width - 62, 24 + k * tall / 100, 14, tall / 100 + 0.5); }
    pen.fillStyle = '#52606d'; pen.fillText(number(full[kind]), width - 44, 32); pen.fillText(kind === 'value' ? '0' : number(-full[kind]), width - 44, 24 + tall); pen.fillText(data.unit, width - 62, 14);
    told.textContent = `${turn.value}°, ${near} of ${count} samples`;
    box.dataset.near = near;
  };
  let held = null;
  canvas.addEventListener('pointerdown', event => { held = [event.clientX, Number(turn.value)]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointermove', event => { if (held) { turn.value = (held[1] + Math.round((event.clientX - held[0]) / 2) + 360) % 180; draw(); } });
  canvas.addEventListener('pointerup', () => { held = null; });
  turn.addEventListener('input', draw); what.addEventListener('change', draw); addEventListener('resize', draw);
  draw();
}
