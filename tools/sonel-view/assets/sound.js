// Hearing: a dry sound through the impulse responses at the ears, at equal level, or with the gain of A where there is one. While the listener walks, the dry sound goes over from one
// response to the next, whose parts add up to the whole at any time; what has gone into the older ones rings out.
"use strict";
const FADE_S = 0.06;
const RATE_HZ = 48000;
// Responses that ring at once.
const MOST_CHAINS = 10;
// An older response has rung out where this share of its energy is left.
const INAUDIBLE = 1e-4;

class Hearing {
  // Two bare syllables a second: a buzz through two resonances, with pauses in which the room is heard.
  static syllables(context) {
    const length = 4 * RATE_HZ, buffer = context.createBuffer(1, length, RATE_HZ), samples = buffer.getChannelData(0);
    const vowels = [[700, 1200], [300, 2300], [450, 1900], [350, 800]];
    let seed = 1;
    const noise = () => { seed = (seed * 1664525 + 1013904223) % 4294967296; return seed / 2147483648 - 1; };
    vowels.forEach((formants, syllable) => {
      const begin = syllable * RATE_HZ, voiced = 0.35 * RATE_HZ;
      for (let i = 0; i < 0.03 * RATE_HZ; i++) samples[begin + i] += 0.15 * noise() * (1 - i / (0.03 * RATE_HZ));
      for (const formant of formants) {
        const turn = 2 * Math.PI * formant / RATE_HZ, decay = Math.exp(-Math.PI * 90 / RATE_HZ);
        let one = 0, two = 0, phase = 0;
        for (let i = 0; i < voiced; i++) {
          phase += (120 - 20 * i / voiced) / RATE_HZ;
          const pulse = phase >= 1 ? 1 : 0;
          phase %= 1;
          const now = pulse + 2 * decay * Math.cos(turn) * one - decay * decay * two;
          [one, two] = [now, one];
          samples[begin + 1500 + i] += 0.2 * now * Math.sin(Math.PI * i / voiced);
        }
      }
    });
    return buffer;
  }

  static clicks(context) {
    const buffer = context.createBuffer(1, 1.5 * RATE_HZ, RATE_HZ);
    buffer.getChannelData(0)[100] = 1;
    return buffer;
  }

  constructor(context = new AudioContext({ sampleRate: RATE_HZ })) {
    Object.assign(this, { context, chains: [], source: null });
    this.out = context.createDynamicsCompressor();
    this.out.threshold.value = -3;
    this.out.connect(context.destination);
    this.meter = context.createAnalyser();
    this.out.connect(this.meter);
  }

  async play(kind, file) {
    this.stop();
    await this.context.resume();
    this.begin(kind === "file" && file ? await this.context.decodeAudioData(await file.arrayBuffer())
      : kind === "speech" ? Hearing.syllables(this.context) : Hearing.clicks(this.context));
  }

  // Both ears hear all channels of the dry sound.
  begin(dry) {
    this.source = new AudioBufferSourceNode(this.context, { buffer: dry, loop: true });
    this.dry = new GainNode(this.context, { channelCount: 1, channelCountMode: "explicit" });
    this.source.connect(this.dry);
    this.source.start();
  }

  // Samples of both ears, left first.
  hear(samples) {
    clearTimeout(this.waiting);
    if (!this.source || !samples) return;
    const now = this.context.currentTime, [older] = this.chains.slice(-1);
    this.chains.filter(({ end }) => end <= now).forEach(({ level }) => level.disconnect());
    this.chains = this.chains.filter(({ end }) => end > now);
    // A fade ends before the next one begins; a walk waits where too much rings.
    const free = Math.max(older?.faded ?? 0, this.chains.length < MOST_CHAINS ? 0 : Math.min(...this.chains.map(({ end }) => end)));
    if (free > now) {
      this.waiting = setTimeout(() => this.hear(samples), 1000 * (free - now) + 5);
      return;
    }
    const length = samples.length / 2, response = this.context.createBuffer(2, length, RATE_HZ);
    response.copyToChannel(samples.subarray(0, length), 0);
    response.copyToChannel(samples.subarray(length), 1);
    const left = energies(samples), faded = now + FADE_S;
    const input = new GainNode(this.context), convolver = new ConvolverNode(this.context, { buffer: response, disableNormalization: true });
    // Equal level: the energy of the response is 1; beside A, that of A.
    const level = new GainNode(this.context, { gain: 0.35 / Math.sqrt((this.before ? energies(this.before) : left)[0] || 1) });
    this.dry.connect(input).connect(convolver).connect(level).connect(this.out);
    if (older) {
      input.gain.setValueAtTime(0, now).linearRampToValueAtTime(1, faded);
      older.input.gain.setValueAtTime(1, now).linearRampToValueAtTime(0, faded);
      older.end = faded + older.rings;
    }
    this.chains.push({ input, level, faded: older ? faded : now, end: Infinity, rings: left.findIndex((energy) => energy <= INAUDIBLE * left[0]) * PART_S });
  }

  stop() {
    clearTimeout(this.waiting);
    this.source?.stop();
    this.source = null;
    this.chains.forEach(({ level }) => level.disconnect());
    this.chains = [];
  }
}

// Energy of a response of both ears from every 10 ms on.
const PART_S = 0.01;
function energies(samples) {
  const length = samples.length / 2, step = PART_S * RATE_HZ, left = new Array(Math.ceil(length / step) + 1).fill(0);
  for (let part = left.length - 2; part >= 0; part--) {
    left[part] = left[part + 1];
    for (let i = part * step; i < Math.min(length, (part + 1) * step); i++) left[part] += (samples[i] ** 2 + samples[length + i] ** 2) / 2;
  }
  return left;
}
