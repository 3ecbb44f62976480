"""Sphinx makes the site of the pages that `cargo xtask site` has put together."""

project = "sonel"
author = "the sonel contributors"
copyright = "the sonel contributors, MIT or Apache-2.0"
extensions = ["myst_parser", "sphinx_copybutton"]
root_doc = "docs/README"
exclude_patterns = ["site-*"]
highlight_language = "none"
# Anchors as GitHub makes them: the pages link by them.
myst_heading_anchors = 4
myst_links_external_new_tab = False
# Pages beside the list of docs/README.md are reached by links.
suppress_warnings = ["toc.not_included", "myst.header"]
html_theme = "furo"
html_title = "sonel"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = "$ "
