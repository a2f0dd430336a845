"""Identification of a muscle from its trials: the paper's models and physical ones, terms,
intervals, a plant file.
"""
