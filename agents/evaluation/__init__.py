"""Evaluation of controllers: runs, growth rates, nonlinear critical speeds, tables and pictures."""
