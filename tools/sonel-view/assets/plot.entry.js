export { areaY, dot, lineY, link, plot, pointer, rect, ruleX, tip } from '@observablehq/plot';
