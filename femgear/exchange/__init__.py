"""Other people's formats: WAV, universal file, spreadsheet and MATLAB."""
