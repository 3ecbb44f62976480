// Hearing: a dry sound through the impulse responses at the ears, at equal level, cross-faded while the listener walks.
"use strict";
const FADE_S = 0.15;
const RATE_HZ = 48000;

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

  constructor() {
    this.context = new AudioContext({ sampleRate: RATE_HZ });
    this.out = this.context.createDynamicsCompressor();
    this.out.threshold.value = -3;
    this.out.connect(this.context.destination);
    this.meter = this.context.createAnalyser();
    this.out.connect(this.meter);
  }

  async play(kind, file) {
    this.stop();
    await this.context.resume();
    this.dry = kind === "file" && file ? await this.context.decodeAudioData(await file.arrayBuffer())
      : kind === "speech" ? Hearing.syllables(this.context) : Hearing.clicks(this.context);
    this.source = this.context.createBufferSource();
    this.source.buffer = this.dry;
    this.source.loop = true;
    this.source.start();
  }

  // Both ears, left first; the older response fades out.
  hear(samples) {
    if (!this.source || !samples) return;
    const length = samples.length / 2, response = this.context.createBuffer(2, length, RATE_HZ);
    response.copyToChannel(samples.subarray(0, length), 0);
    response.copyToChannel(samples.subarray(length), 1);
    const convolver = this.context.createConvolver(), gain = this.context.createGain(), now = this.context.currentTime;
    convolver.normalize = false;
    convolver.buffer = response;
    // Equal level: the energy of the response is 1.
    const energy = samples.reduce((sum, sample) => sum + sample * sample, 0) / 2;
    gain.gain.setValueAtTime(0, now);
    gain.gain.linearRampToValueAtTime(0.35 / Math.sqrt(energy || 1), now + FADE_S);
    this.source.connect(convolver).connect(gain).connect(this.out);
    const older = this.chain;
    if (older) {
      older.gain.gain.setTargetAtTime(0, now, FADE_S / 3);
      setTimeout(() => { older.gain.disconnect(); older.convolver.disconnect(); }, 4000 * FADE_S);
    }
    this.chain = { convolver, gain };
  }

  stop() {
    this.source?.stop();
    this.source = null;
    this.chain?.gain.disconnect();
    this.chain = null;
  }
}
