#pragma once
// The style sheet of report.html: quiet greys and one accent, light or dark as the reader's system is.

namespace gart_cli {

inline constexpr char report_style[] = R"css(
:root { color-scheme: light dark; --page: #fbfbfa; --card: #ffffff; --ink: #1c1e21; --soft: #667079; --rule: #e4e6e8;
  --one: #2563c9; --two: #d9730d; --three: #2c8a5a; --four: #9a3fb0; --five: #b8283f; --six: #7b7a1e; --bar: #c9d8f0;
  --dim: #b9c0c6; }
@media (prefers-color-scheme: dark) { :root { --page: #131517; --card: #1b1e21; --ink: #e6e8ea; --soft: #98a1aa;
  --rule: #2d3236; --one: #74a7f5; --two: #f0a04b; --three: #63c795; --four: #cf8ee0; --five: #f0808d; --six: #c9c763;
  --bar: #2c4468; --dim: #566069; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 40px 24px 64px; }
h1 { font-size: 28px; font-weight: 650; letter-spacing: -0.01em; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 17px; font-weight: 650; margin: 44px 0 12px; }
p { margin: 6px 0; max-width: 80ch; } .soft, figcaption, th { color: var(--soft); }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin-top: 26px; }
.figures div, .chart, .box { background: var(--card); border: 1px solid var(--rule); border-radius: 10px; padding:
  14px 16px; }
.figures b { display: block; font-size: 25px; font-weight: 620; letter-spacing: -0.01em; font-variant-numeric:
  tabular-nums; }
.figures small { font-size: 14px; font-weight: 450; color: var(--soft); margin-left: 3px; }
.figures span { color: var(--soft); font-size: 13px; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); gap: 12px; }
figure { margin: 0; }
.chart figcaption { display: flex; flex-wrap: wrap; gap: 4px 16px; font-size: 13px; margin-bottom: 6px; }
.chart figcaption b { color: var(--ink); font-size: 14px; font-weight: 600; margin-right: auto; }
.key i { display: inline-block; width: 14px; height: 3px; border-radius: 2px; margin-right: 6px; vertical-align:
  middle; }
.swatch-1 { background: var(--one); } .swatch-2 { background: var(--two); }
.swatch-3 { background: var(--three); } .swatch-4 { background: var(--four); } .swatch-5 { background: var(--five); }
.swatch-6 { background: var(--six); }
svg { display: block; width: 100%; height: auto; } .grid { stroke: var(--rule); stroke-width: 1; }
.tick { fill: var(--soft); font: 11px system-ui, sans-serif; font-variant-numeric: tabular-nums; }
polyline { fill: none; stroke-width: 1.6; stroke-linejoin: round; stroke-linecap: round; }
polyline.line-1 { stroke: var(--one); } polyline.line-2 { stroke: var(--two); }
polyline.line-3 { stroke: var(--three); } polyline.line-4 { stroke: var(--four); }
polyline.line-5 { stroke: var(--five); } polyline.line-6 { stroke: var(--six); }
circle.dim { fill: var(--dim); } text.dim, tr.dim { fill: var(--soft); color: var(--soft); }
.label { fill: var(--ink); font: 11px system-ui, sans-serif; } .leader { stroke: var(--rule); stroke-width: 1; }
.wide { overflow-x: auto; }
circle.line-1 { fill: var(--one); } circle.line-2 { fill: var(--two); }
circle.line-3 { fill: var(--three); } circle.line-4 { fill: var(--four); } circle.line-5 { fill: var(--five); }
circle.line-6 { fill: var(--six); }
.cover { margin-top: 18px; } .cover img { display: block; width: 100%; max-height: 62vh; object-fit: contain;
  background: var(--card); border: 1px solid var(--rule); border-radius: 10px; }
.cover figcaption { font-size: 13px; margin-top: 5px; overflow-wrap: anywhere; }
.view { margin-bottom: 22px; } .view .images { display: grid; grid-template-columns: repeat(2, 1fr); gap: 8px; }
.view img { display: block; width: 100%; border-radius: 6px; border: 1px solid var(--rule); }
.view figcaption { display: flex; flex-wrap: wrap; gap: 2px 14px; overflow-wrap: anywhere; font-size: 13px; margin-bottom: 6px; }
.view figcaption b { color: var(--ink); }
h3 { font-size: 13px; font-weight: 600; margin: 0 0 6px; }
.side { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 220px), 1fr)); gap: 8px; }
.view .side figcaption { margin: 4px 0 0; }
.slide { --at: 50%; position: relative; overflow: hidden; border-radius: 6px; }
.slide img + img { position: absolute; inset: 0; clip-path: inset(0 calc(100% - var(--at)) 0 0); }
.slide i { position: absolute; left: var(--at); top: 0; bottom: 0; width: 2px; margin-left: -1px; background: #fff;
  box-shadow: 0 0 4px rgba(0, 0, 0, 0.6); }
.slide i::after { content: ""; position: absolute; left: -9px; top: calc(50% - 14px); width: 20px; height: 28px;
  border-radius: 10px; background: #fff; box-shadow: 0 1px 4px rgba(0, 0, 0, 0.4); }
.slide input { position: absolute; inset: 0; width: 100%; height: 100%; margin: 0; opacity: 0; cursor: ew-resize; }
.slide:focus-within { outline: 2px solid var(--one); outline-offset: 2px; }
.heads { display: grid; grid-template-columns: repeat(2, 1fr); gap: 8px; font-size: 13px; color: var(--soft); margin:
  12px 0 8px; }
.scale { display: inline-block; width: 84px; height: 9px; border-radius: 3px; margin: 0 6px; vertical-align: middle; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: left; font-weight: 450; font-size: 13px; }
th, td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--rule); }
tr:last-child td { border-bottom: 0; } td.n, th.n { text-align: right; white-space: nowrap; width: 1%; }
td.bar { width: 45%; padding-right: 0; }
td.bar i { display: block; height: 9px; border-radius: 3px; background: var(--bar); }
.columns { columns: 2 380px; column-gap: 40px; overflow-x: auto; } .box { overflow-x: auto; }
td.v { overflow-wrap: anywhere; }
.settings { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 290px), 1fr)); gap: 0
  36px; }
.settings div { display: flex; justify-content: space-between; gap: 16px; padding: 5px 0; border-bottom: 1px solid
  var(--rule);
  font-size: 14px; } .settings span { color: var(--soft); }
.settings b { font-weight: 500; overflow-wrap: anywhere; text-align: right; }
summary { cursor: pointer; color: var(--soft); font-size: 14px; margin: 8px 0; }
.box + p { margin-top: 16px; }
footer { margin-top: 48px; color: var(--soft); font-size: 13px; }
@media (max-width: 560px) { main { padding: 24px 14px 40px; } th, td { padding-right: 8px; }
  th.n { white-space: normal; } td.bar { width: 25%; } }
)css";

}  // namespace gart_cli
