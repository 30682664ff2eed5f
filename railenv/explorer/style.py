"""The style sheets of the page's parts."""

from __future__ import annotations

from design.style import STABLE, UNSTABLE

FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"
INK, LABEL, EDGE, PAPER = "#262d31", "#5c666b", "#dfe4e7", "#f3f5f6"

WHOLE = f"""
html, body {{ background: {PAPER}; font-family: {FONT}; color: {INK}; margin: 0; height: auto; }}
"""

PAGE = """
:host { display: block; max-width: 1720px; margin: 0 auto; padding: 0 14px 30px; }
@media (max-width: 760px) { :host { padding: 0 8px 24px; } }
"""

COLUMNS = """
:host { display: grid !important; grid-template-columns: 320px minmax(0, 1fr); gap: 14px;
  align-items: start; }
:host > * { min-width: 0; max-width: 100%; }
@media (max-width: 900px) { :host { grid-template-columns: minmax(0, 1fr); } }
"""

SIDE = """
:host { position: sticky; top: 100px; max-height: calc(100vh - 110px); overflow-y: auto;
  scrollbar-width: thin; }
@media (max-width: 900px) { :host { position: static; max-height: none; overflow: visible; } }
"""

HEAD = f"""
:host {{ position: sticky; top: 0; z-index: 20; background: {PAPER}; padding: 10px 0 24px;
  display: grid !important; grid-template-columns: minmax(0, 1fr) auto; gap: 6px 14px;
  align-items: center; }}
@media (max-width: 900px) {{ :host {{ grid-template-columns: minmax(0, 1fr); padding: 6px 0 24px; }} }}
"""

ANSWER = f"""
:host {{ font-family: {FONT}; color: {INK}; margin: 0; }}
h1 {{ font-size: 21px; font-weight: 650; margin: 0 0 2px; line-height: 1.25; }}
h1 small {{ font-weight: 400; color: {LABEL}; font-size: 15px; }}
p {{ margin: 0; font-size: 14px; color: {LABEL}; line-height: 1.35; }}
.dot {{ display: inline-block; width: 11px; height: 11px; border-radius: 50%; margin-right: 7px; }}
.stable {{ background: {STABLE}; }} .unstable {{ background: {UNSTABLE}; }}
  .unknown {{ background: #9aa5ab; }}
@media (max-width: 900px) {{ h1 {{ font-size: 16px; }} h1 small {{ font-size: 13px; }}
  p {{ font-size: 12.5px; }} }}
"""

MESSAGE = f"""
:host {{ font-family: {FONT}; }}
div[role=alert] {{ border-left: 4px solid {UNSTABLE}; background: #fdf0ec; color: {INK};
  padding: 9px 12px;
  border-radius: 4px; font-size: 14px; line-height: 1.4; overflow-wrap: anywhere; }}
"""

WORK = """
:host { transition: opacity 0.15s; position: absolute !important; left: 0; right: 0; bottom: 0;
  pointer-events: none; }
"""

GRID = """
:host { display: grid !important;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)); gap: 12px; }
:host > * { min-width: 0; }
"""

THIRDS = """
:host { display: grid !important;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 270px), 1fr)); gap: 6px; }
:host > * { min-width: 0; }
"""

VIEWS = """
:host { display: grid !important; grid-template-columns: minmax(0, 3fr) minmax(0, 1.15fr);
  gap: 6px; }
:host > * { min-width: 0; }
@media (max-width: 760px) { :host { grid-template-columns: minmax(0, 1fr); } }
"""

PLAYER = """
:host { display: grid !important; grid-template-columns: 270px 90px minmax(0, 1fr);
  align-items: center; }
:host > * { min-width: 0; }
@media (max-width: 760px) { :host { grid-template-columns: minmax(0, 1fr) 90px; } }
"""

PANEL = f"""
:host {{ background: #ffffff; border: 1px solid {EDGE}; border-radius: 8px; padding: 8px 10px;
  box-sizing: border-box; }}
"""

CARD = f"""
:host {{ background: #ffffff; border: 1px solid {EDGE}; border-radius: 8px; box-shadow: none;
  outline: none; font-family: {FONT}; }}
.card-header {{ background: #ffffff; border: none; padding: 7px 10px; border-radius: 8px; }}
.card-title, .card-header h3 {{ font-size: 14px !important; font-weight: 600; color: {INK}; }}
.card-button {{ color: {LABEL}; }}
"""

CONTROL = f"""
:host {{ font-family: {FONT}; font-size: 13px; color: {LABEL}; --design-primary-color: {STABLE}; }}
label, .bk-slider-title {{ font-size: 13px; color: {LABEL}; }}
.bk-btn {{ font-size: 13px; white-space: normal; padding: 5px 6px; line-height: 1.15; }}
.bk-btn.bk-active {{ background: {STABLE} !important; color: #ffffff !important;
  border-color: {STABLE} !important; }}
"""

DROP = f"""
:host {{ padding: 2px 8px 6px; box-sizing: border-box; }}
input[type=file] {{ width: 100%; box-sizing: border-box; border: 1.5px dashed #b4bdc2;
  border-radius: 6px;
  padding: 9px 8px; background: {PAPER}; font: 12px {FONT}; color: {LABEL}; cursor: pointer; }}
input[type=file]:hover {{ border-color: {STABLE}; }}
"""

BUTTON = f"""
:host {{ font-family: {FONT}; }}
.bk-btn {{ font: 550 13px {FONT} !important; border-radius: 6px !important;
  padding: 7px 12px !important;
  border: 1px solid {STABLE} !important; color: {STABLE} !important;
  background: #ffffff !important; }}
.bk-btn:hover {{ background: #eaf3f6 !important; }}
.bk-btn[disabled] {{ opacity: 0.45; }}
.bk-btn a {{ text-decoration: none; padding: 0 !important; color: inherit !important; }}
"""

STRONG = (
    BUTTON
    + f"""
.bk-btn {{ background: {STABLE} !important; color: #ffffff !important; }}
.bk-btn:hover {{ background: #185a71 !important; }}
"""
)

DOING = f"""
:host {{ font: 11px/1.3 {FONT}; color: {LABEL}; }}
"""

NOTE = f"""
:host {{ font-family: {FONT}; font-size: 13px; color: {LABEL}; line-height: 1.4; }}
"""

CODE = f"""
textarea {{
  font: 12px/1.45 ui-monospace, 'SF Mono', Menlo, 'DejaVu Sans Mono', monospace !important;
  color: {INK};
  background: {PAPER}; opacity: 1 !important; white-space: pre; overflow: auto;
  cursor: text !important; }}
"""
