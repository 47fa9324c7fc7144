"""Figures, tables and the HTML report: they show results and compute no physics.

The modules in reading order; others may use the names beside them:

- `words`: wording that tables, figures and pages share.
- `errata`: errors and omissions of the paper.
- `verdict`: comparison of results with the paper's claims: `verdicts`, `row_of`.
- `figures`: the figures, each with its data.
- `statistics`: figures 12 and 13 as tables: `findings`.
- `tables`: tables for a terminal: `claims_table`, `variants_table`, `statistics_table`.
- `correlation`: tables and files of section V: `correlation_table`, `shape_table`,
  `correlation_csv`, `correlation_json`, `write_correlation`.
- `run_plots`: figures of a run by name and as matplotlib axes: `draw`, `RunPlots`.
- `record`: all results as JSON: `results_json`.
- `answer`: the answer of the paper's page in a few sentences.
- `page_data`, `street_model`: the numbers that the scripts of a page draw.
- `page_parts`, `templates`: what all HTML pages share: tables, pictures, style sheet, scripts.
- `html`: the page of the paper.
- `paper`: all files of `polychirp paper`: `write_paper`.
- `run_page`, `study_page`: the pages of a stored run and study: `write_run_page`,
  `write_study_page`.
"""
