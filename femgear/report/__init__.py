"""Report: figures, tables, grids for ParaView, and one page of HTML for a run."""
