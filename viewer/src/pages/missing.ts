/** An unknown address: the server writes the page, which needs only the style. */
import '../style/base.css';
